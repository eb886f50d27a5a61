/** Names of rooms over the picture, moved with every frame: of opened floors, where there is room for them. */

import { useEffect, useRef } from 'preact/hooks';
import { sliceOfFloor } from '../floors/cut.ts';
import type { PlanView } from '../scene/plan-view.ts';
import type { Store } from '../store.ts';
import { type NameBox, namesWithRoom } from './names-with-room.ts';
import './rooms.css';

export function RoomNames({ store, view }: { store: Store; view: PlanView }) {
  const names = useRef(new Map<number, HTMLElement>());
  useEffect(
    () =>
      view.onFrame(() => {
        const boxes: NameBox[] = [];
        for (const [number, name] of names.current) {
          const room = store.rooms.peek()?.[number]?.room;
          const isDrawn = room !== undefined && sliceOfFloor(store.slices.peek(), room.floor)?.floorId === room.floor;
          // As high as one looks into the room: its ground is mostly behind a wall.
          const [x, y, z] = room?.label ?? [0, 0, 0];
          const at = isDrawn ? view.project([x, y, z + Math.min(store.cutM.peek(), EYE_M)], room.floor) : null;
          name.hidden = true;
          if (at === null || room === undefined) continue;
          const [[x0, y0], [x1, y1]] = room.box;
          // In a room that is smaller than its name, as far off, it would stand over others.
          if (Number(name.dataset.width) > MOST_OVER * (Math.max(x1 - x0, y1 - y0) / view.metresPerPixel())) continue;
          const size = { width: Number(name.dataset.width), height: NAME_HEIGHT };
          boxes.push({
            number,
            ...at,
            ...size,
            rank: number === store.roomNumber.peek() ? 1e9 : (x1 - x0) * (y1 - y0),
          });
        }
        for (const { number, x, y } of namesWithRoom(boxes)) {
          const name = names.current.get(number);
          if (name === undefined) continue;
          name.hidden = false;
          name.style.transform = `translate(-50%, 0) translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
        }
      }),
    [view],
  );
  const { rooms, showsRoomNames, isWalking, roomNumber } = store;
  useEffect(() => view.requestFrame(), [rooms.value, showsRoomNames.value, isWalking.value, view]);
  if (!showsRoomNames.value || isWalking.value) return null;
  return (
    <div class="room-names" aria-hidden="true">
      {(rooms.value ?? []).map(({ number, name }) => (
        <span
          key={number}
          class={roomNumber.value === number ? 'room-name room-name-chosen' : 'room-name'}
          hidden
          ref={(span) => {
            if (span === null) names.current.delete(number);
            else {
              names.current.set(number, span);
              // Measured once: reading sizes in every frame would lay the page out each time.
              span.hidden = false;
              span.dataset.width = String(span.offsetWidth);
              span.hidden = true;
            }
          }}
        >
          {name}
        </span>
      ))}
    </div>
  );
}

const EYE_M = 1.3;
/** A name is at most so much wider than its room in the picture. */
const MOST_OVER = 1.2;
/** Of a line of `.room-name`, pixels. */
const NAME_HEIGHT = 18;
