/** Whether keys of one character (letters, digits, + and -) do anything: who speaks to the machine types them by chance. Kept by the browser. */
import { signal } from '@preact/signals';
import type { UnitStorage } from './units.ts';

const KEY = 'tlsplan-character-keys';

export const hasCharacterKeys = signal(true);

/** Take the choice of the last visit; anything but off is on. */
export function restoreCharacterKeys(storage: UnitStorage): void {
  hasCharacterKeys.value = storage.getItem(KEY) !== 'off';
}

export function chooseCharacterKeys(storage: UnitStorage, isOn: boolean): void {
  hasCharacterKeys.value = isOn;
  storage.setItem(KEY, isOn ? 'on' : 'off');
}

/** Whether a key is to be taken: those with a name, as Escape and the arrows, always are. */
export function isKeyOn(key: string): boolean {
  return key.length > 1 || hasCharacterKeys.peek();
}
