'use strict';
// One page, no framework: it has to open from a file on a phone, in ten years too.
const plan = JSON.parse(document.getElementById('plan').textContent);
const page = document.getElementById('page');
const key = `tlsplan-field ${plan.plan_sha256} ${plan.revision}`;
const LABELS = { done: 'Done', skipped: 'Skipped' };
let keeps = true;
let isPlacing = false;
let isNear = false;
/** What became of the last tap; empty: nothing to say. */
let placed = '';
let saved = '';
const kept = read();
let chosen = next();

function read() {
  const empty = { name: '', stations: {} };
  try {
    const found = JSON.parse(localStorage.getItem(key) || 'null');
    return found && typeof found.stations === 'object' ? found : empty;
  } catch {
    return empty;
  }
}
function keep() {
  try {
    localStorage.setItem(key, JSON.stringify(kept));
    keeps = true;
  } catch {
    keeps = false;
  }
}
function of(id) {
  return kept.stations[id] || { state: null, at: null, moved_to: null, note: '', photo: false };
}
function change(id, what) {
  kept.stations[id] = { ...of(id), ...what, at: new Date().toISOString().slice(0, 19) + 'Z' };
  saved = '';
  keep();
}
/** The first that nothing became of yet; null: all are through. */
function next() {
  return plan.stations.find(({ id }) => of(id).state === null) || null;
}
function make(tag, attributes, ...inside) {
  const isDrawn = ['svg', 'path', 'circle', 'text', 'g', 'line'].includes(tag);
  const one = isDrawn ? document.createElementNS('http://www.w3.org/2000/svg', tag) : document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith('on')) one.addEventListener(name.slice(2), value);
    else if (value !== false && value !== null) one.setAttribute(name, value === true ? '' : value);
  }
  one.append(...inside.filter((each) => each !== null));
  return one;
}
/** Nearest to a tap, (x, y), where a tripod stands: as far off walls as the plan keeps; null: nowhere within a metre. */
function tripodPlace([x, y], floor, room) {
  let best = null;
  let least = 1;
  for (let i = -20; i <= 20; i++) {
    for (let j = -20; j <= 20; j++) {
      const at = [x + i / 20, y + j / 20];
      const away = Math.hypot(i, j) / 20;
      if (away < least && isOn(floor, at) && !isIn(floor, at) && roomAt(floor, at) >= room) [best, least] = [at, away];
    }
  }
  return best;
}
const isOn = ({ bounds: [[x0, y0], [x1, y1]] }, [x, y]) => x >= x0 && x <= x1 && y >= y0 && y <= y1;
/** Within what the cut goes through, by even and odd crossings to the right. */
function isIn(floor, [x, y]) {
  let n = 0;
  for (const [x1, y1, x2, y2] of segments(floor)) {
    if (y1 > y !== y2 > y && x < x1 + ((y - y1) / (y2 - y1)) * (x2 - x1)) n += 1;
  }
  return n % 2 === 1;
}
/** Distance to the nearest of what is drawn. */
function roomAt(floor, [x, y]) {
  let least = Infinity;
  for (const [x1, y1, x2, y2] of segments(floor)) {
    const [dx, dy] = [x2 - x1, y2 - y1];
    const along = Math.min(1, Math.max(0, ((x - x1) * dx + (y - y1) * dy) / (dx * dx + dy * dy || 1)));
    least = Math.min(least, Math.hypot(x - x1 - along * dx, y - y1 - along * dy));
  }
  return least;
}
/** Whether a wall is between two places. */
function isBehindWall(floor, [ax, ay], [bx, by]) {
  const side = (px, py, qx, qy, x, y) => (qx - px) * (y - py) - (qy - py) * (x - px) > 0;
  return segments(floor).some(([x1, y1, x2, y2]) =>
    side(ax, ay, bx, by, x1, y1) !== side(ax, ay, bx, by, x2, y2) &&
    side(x1, y1, x2, y2, ax, ay) !== side(x1, y1, x2, y2, bx, by));
}
/** [x1, y1, x2, y2] of all lines of a floor's map. */
function segments(floor) {
  floor.segments ??= floor.walls.flatMap((flat) =>
    Array.from({ length: Math.max(0, flat.length / 2 - 1) }, (_, i) => flat.slice(2 * i, 2 * i + 4)));
  return floor.segments;
}
const metres = (value) => `${value.toFixed(2)} m`;
/** E, N, H of a place of the scene, in the site's unit; null: its coordinates are not known. */
function siteOf([x, y, z]) {
  if (plan.site === null) return null;
  return plan.site.from_scene.map((row) => (row[0] * x + row[1] * y + row[2] * z + row[3]) / plan.site.metres_per_unit);
}
/** Where a station stands, (x, y, z) of the scene: tripods are moved in plan. */
function standsAt(station) {
  return [...(of(station.id).moved_to || station.position.slice(0, 2)), station.position[2]];
}
function placeWords(station) {
  const site = siteOf(standsAt(station));
  if (site === null) return standsAt(station).slice(0, 2).map((value, i) => `${'xy'[i]} ${value.toFixed(2)}`).join(', ');
  return `${site.map((value, i) => `${'ENH'[i]} ${value.toFixed(2)}`).join(', ')} ${plan.site.unit}`;
}
/** Of plans whose stations do not all register: which ones this one does with. */
function groupWords({ id }) {
  const number = plan.groups.findIndex((ids) => ids.includes(id));
  if (plan.groups.length < 2) return null;
  if (number < 0) return 'Added in the review: its group is not known.';
  const others = plan.groups[number].filter((other) => other !== id);
  const named = `${others.slice(0, 8).join(', ')}${others.length > 8 ? ` and ${others.length - 8} more` : ''}`;
  const words = others.length ? `with ${named}` : 'alone';
  return `Group ${number + 1} of ${plan.groups.length}, ${words}: does not register with the others.`;
}
/** Of pairs that targets register: whom a station needs them with, and where they hang. */
const targetsOf = ({ id }) => plan.targets.filter(({ stations }) => stations.includes(id));
function targetWords(station) {
  return targetsOf(station).map(({ stations, places }) => {
    const where = places.map((place) => {
      const site = siteOf(place);
      const [x, y, z] = site || place;
      return `(${[x, y, z].map((value) => value.toFixed(2)).join(', ')})`;
    });
    return `Three targets with ${stations.find((id) => id !== station.id)}: ${where.join(' ')}`;
  });
}
const awayOf = ({ id, position: [x, y] }) => {
  const to = of(id).moved_to;
  return to === null ? 0 : Math.hypot(to[0] - x, to[1] - y);
};
function wordsOf(station) {
  const { state, note, photo } = of(station.id);
  const away = awayOf(station);
  return [LABELS[state], away > 0 && `moved ${metres(away)}`, note && 'note', photo && 'photo'].filter(Boolean).join(' · ');
}
function draw() {
  const nDone = plan.stations.filter(({ id }) => of(id).state === 'done').length;
  const nSkipped = plan.stations.filter(({ id }) => of(id).state === 'skipped').length;
  const focused = document.activeElement && document.activeElement.id;
  page.replaceChildren(...[
    make('header', {}, make('strong', { id: 'count' }, `${nDone} of ${plan.stations.length} done`),
      make('span', { class: 'quiet' }, nSkipped ? `${nSkipped} skipped` : plan.title)),
    make('progress', { max: Math.max(1, plan.stations.length), value: nDone + nSkipped, 'aria-label': 'Stations through' }),
    keeps ? null : make('p', { class: 'warn', role: 'alert' },
      'This browser keeps nothing of a file: save the result before you close the page.'),
    chosen === null ? make('section', {}, make('h1', {}, 'All through'),
      make('p', {}, 'Save the result and hand it to the office.')) : card(chosen),
    ...list(),
    ...result(),
  ].filter((each) => each !== null));
  if (focused) document.getElementById(focused)?.focus();
}
function card(station) {
  const { state, note, photo } = of(station.id);
  const floor = plan.floors.find(({ id }) => id === station.floor);
  const height = station.instrument_height_m;
  const group = groupWords(station);
  const act = (name, label, todo, isOn) =>
    make('button', { type: 'button', id: `act-${name}`, 'aria-pressed': String(isOn), onclick: todo }, label);
  const setState = (to) => () => {
    change(station.id, { state: state === to ? null : to });
    isPlacing = false;
    placed = '';
    if (state !== to) chosen = next();
    draw();
    scrollTo(0, 0);
  };
  return make('section', { 'aria-label': 'Station' },
    make('div', { class: 'next' },
      make('div', { class: 'number', 'aria-hidden': 'true' }, String(station.number)),
      make('div', {}, make('h1', { id: 'station' }, station.id),
        make('p', {}, `${floor ? floor.name : ''}${height === null ? '' : ` · sensor ${metres(height)} high`}`),
        make('p', { class: 'quiet', id: 'place' }, placeWords(station)),
        group === null ? null : make('p', { class: 'quiet', id: 'group' }, group),
        ...targetWords(station).map((words) => make('p', { class: 'targets' }, words)))),
    make('div', { class: 'acts' }, act('done', 'Done', setState('done'), state === 'done'),
      act('moved', awayOf(station) > 0 ? 'Moved' : 'Move', () => { isPlacing = !isPlacing; placed = ''; draw(); },
        isPlacing || awayOf(station) > 0),
      act('skipped', 'Skip', setState('skipped'), state === 'skipped')),
    isPlacing || placed ? make('p', { class: 'warn', id: 'placed', role: 'status' }, placed || 'Tap the map where it stands.') : null,
    awayOf(station) > 0 ? make('p', {}, `Moved by ${metres(awayOf(station))}. `,
      make('button', { type: 'button', id: 'act-back', onclick: () => { change(station.id, { moved_to: null }); placed = ''; draw(); } },
        'Back to the plan')) : null,
    floor ? map(floor, station) : null,
    floor ? make('button', { type: 'button', id: 'act-near', 'aria-pressed': String(isNear),
      onclick: () => { isNear = !isNear; draw(); } }, isNear ? 'Whole floor' : 'Zoom in') : null,
    make('label', {}, 'Note', make('textarea', { id: 'note', rows: 2, maxlength: 2000,
      oninput: (event) => { change(station.id, { note: event.target.value }); } }, note)),
    make('label', { class: 'tick' }, make('input', { type: 'checkbox', id: 'photo', checked: photo,
      onchange: (event) => { change(station.id, { photo: event.target.checked }); draw(); } }), 'Photo taken'));
}
function map(floor, station) {
  const here = plan.stations.filter(({ floor: id }) => id === floor.id);
  const [[x0, y0], [x1, y1]] = floor.bounds;
  const margin = 0.6;
  const zoom = isNear ? 3 : 1;
  const size = Math.max(x1 - x0, y1 - y0) / (isNear ? 55 : 26);
  const [width, height] = [(x1 - x0 + 2 * margin) / zoom, (y1 - y0 + 2 * margin) / zoom];
  const [cx, cy] = isNear ? standsAt(station) : [(x0 + x1) / 2, (y0 + y1) / 2];
  const box = [cx - width / 2, -cy - height / 2, width, height];
  const lines = floor.walls.map((flat) => {
    let path = 'M';
    for (let i = 0; i < flat.length; i += 2) path += `${i ? 'L' : ''}${flat[i]},${(-flat[i + 1]).toFixed(2)}`;
    return path;
  });
  const picture = make('svg', { viewBox: box.join(' '), role: 'img', 'aria-label': `Map of ${floor.name}` },
    make('path', { class: 'wall', d: lines.join(''), 'stroke-width': size / 9 }));
  const half = 0.4 * size;
  const square = ([x, y]) => `M${x - half},${-y - half}h${2 * half}v${2 * half}h${-2 * half}z`;
  const targets = targetsOf(station).flatMap(({ places }) => places.map(square));
  if (targets.length) picture.append(make('path', { class: 'target', d: targets.join('') }));
  const away = awayOf(station) > 0 ? of(station.id).moved_to : null;
  if (away !== null) {
    const [x, y] = station.position;
    picture.append(make('line', { class: 'way', x1: x, y1: -y, x2: away[0], y2: -away[1], 'stroke-width': size / 5 }));
  }
  for (const each of [...here.filter((one) => one !== station), station]) {
    const [x, y] = of(each.id).moved_to || each.position;
    const look = each === station ? 'now' : of(each.id).state || '';
    picture.append(make('g', { onclick: () => { if (!isPlacing) { chosen = each; placed = ''; draw(); } } },
      make('circle', { class: `dot ${look}`, cx: x, cy: -y, r: each === station ? 1.25 * size : size, 'stroke-width': size / 6 }),
      make('text', { class: `dot-text ${look ? `${look}-text` : ''}`, x, y: -y, 'font-size': 1.05 * size },
        String(each.number))));
  }
  picture.addEventListener('click', (event) => {
    if (!isPlacing) return;
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(picture.getScreenCTM().inverse());
    place(station, floor, [at.x, -at.y]);
    draw();
  });
  return picture;
}
/** Takes a station to a tap, or as near to it as a tripod stands. */
function place(station, floor, tap) {
  // Never stricter than the plan was: it may have a station in a narrow door.
  const room = Math.min(plan.clearance_m, roomAt(floor, station.position) - 0.01);
  const at = tripodPlace(tap, floor, Math.max(room, 0));
  if (at === null) {
    placed = `No tripod stands there: walls are nearer than ${metres(room)}, or it is off this floor. Tap elsewhere.`;
    return;
  }
  const moved = at.map((value) => Math.round(100 * value) / 100);
  const aside = Math.hypot(moved[0] - tap[0], moved[1] - tap[1]);
  placed = [
    aside > 0.02 && `Set ${metres(aside)} beside the tap, where a tripod stands.`,
    isBehindWall(floor, station.position, moved) && 'A wall is between here and where it was planned: is this the right room?',
  ].filter(Boolean).join(' ');
  change(station.id, { moved_to: moved });
  isPlacing = false;
}
function list() {
  return [make('h2', {}, 'Stations'), make('ol', {}, ...plan.stations.map((station) =>
    make('li', {}, make('button', { type: 'button', 'aria-current': station === chosen ? 'true' : false,
      onclick: () => { chosen = station; isPlacing = false; placed = ''; draw(); scrollTo(0, 0); } },
      make('strong', {}, String(station.number)), make('span', {}, station.id), make('span', {}, wordsOf(station))))))];
}
function result() {
  return [make('h2', {}, 'Result'),
    make('label', {}, 'Your name', make('input', { type: 'text', id: 'name', maxlength: 100, value: kept.name,
      oninput: (event) => { kept.name = event.target.value; keep(); } })),
    make('button', { type: 'button', class: 'main', id: 'save', onclick: save }, 'Save the result'),
    make('p', { class: 'quiet' }, `Coordinates: ${plan.site === null ? 'those of the scene, metres' : plan.site.name}.`),
    make('p', { class: 'quiet', role: 'status' }, saved || 'A file for the office: tab Review of the plan takes it in.')];
}
function save() {
  const document_ = {
    schema: plan.schema, plan_sha256: plan.plan_sha256, revision: plan.revision, name: kept.name.trim(),
    saved_at: new Date().toISOString().slice(0, 19) + 'Z',
    coordinates: plan.site === null ? 'scene coordinates' : plan.site.name,
    stations: plan.stations.filter(({ id }) => kept.stations[id]).map((station) => ({
      id: station.id, ...of(station.id), site_position: siteOf(standsAt(station)),
    })),
  };
  const link = make('a', { href: URL.createObjectURL(new Blob([JSON.stringify(document_, null, 1)], { type: 'application/json' })),
    download: `field-${document_.saved_at.replace(/[^0-9]/g, '')}.json` });
  link.click();
  URL.revokeObjectURL(link.href);
  saved = `Saved as ${link.download}.`;
  draw();
}
draw();
