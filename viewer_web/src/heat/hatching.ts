/** Whether what no station sees is hatched, for those who can't tell it by its colour. Kept by the browser. */
import { signal } from '@preact/signals';
import type { UnitStorage } from '../panels/units.ts';

const KEY = 'tlsplan-hatching';

export const isHatched = signal(false);

/** Take the choice of the last visit; anything but on is off. */
export function restoreHatching(storage: UnitStorage): void {
  isHatched.value = storage.getItem(KEY) === 'on';
}

export function chooseHatching(storage: UnitStorage, isOn: boolean): void {
  isHatched.value = isOn;
  storage.setItem(KEY, isOn ? 'on' : 'off');
}
