/** All styles in the order in which they count, whatever is loaded when: narrow windows and paper last. */
import './field/field.css';
import './drawing/drawing.css';
import './panels/requirements.css';
import './edit/edit.css';
import './ghost/ghost.css';
import './language/language.css';
import './measure/measure.css';
import './network/network.css';
import './rooms/rooms.css';
import './runs/runs.css';
import './shortfalls/shortfalls.css';
import './scene/flat-picture.css';
import './stations/covered-note.css';
import './stations/losses.css';
import './panels/key-cursor.css';
import './sights/sights.css';
import './review/people.css';
import './review/photo.css';
import './review/progress.css';
import './review/review.css';
import './compare/compare.css';
import './panels/toolbar.css';
import './share/share.css';
import './style.css';
// After it: what is said of paper goes over what is said of narrow windows.
import './panels/print.css';
