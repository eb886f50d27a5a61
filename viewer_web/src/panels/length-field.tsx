/** A length or a coordinate that is typed, in the chosen unit: taken when the field is left or Enter is pressed. */

import { useState } from 'preact/hooks';
import { decimal, t } from '../language/language.ts';
import { parseLengthM, units } from './units.ts';

interface LengthFieldProps {
  readonly label: string;
  readonly valueM: number;
  /** Decimals that are shown; what is typed may have more. */
  readonly digits?: number;
  /** Metres of the unit, where that is not the chosen one's. */
  readonly unitM?: number;
  readonly disabled?: boolean;
  readonly onValue: (valueM: number) => void;
}

export function LengthField({ label, valueM, digits = 3, unitM, disabled = false, onValue }: LengthFieldProps) {
  const scale = unitM ?? parseLengthM('1') ?? 1;
  const shown = decimal(valueM / scale, digits);
  const [entry, setEntry] = useState<{ readonly text: string; readonly over: string } | null>(null);
  // A value that changed meanwhile, as by a drag, counts more than what is half typed over the one before.
  const typed = entry?.over === shown ? entry.text : null;
  const parsedM = typed === null ? valueM : parseLengthM(typed, scale);
  const take = (): void => {
    if (typed !== null && parsedM !== null) {
      setEntry(null);
      if (decimal(parsedM / scale, digits) !== shown) onValue(parsedM);
    }
  };
  return (
    <label class="field">
      {label}
      <span class="unit-input">
        <input
          type="text"
          inputMode="decimal"
          value={typed ?? shown}
          disabled={disabled}
          aria-label={`${label}, ${units.value}`}
          aria-invalid={parsedM === null}
          onInput={(event) => setEntry({ text: event.currentTarget.value, over: shown })}
          onBlur={take}
          onKeyDown={(event) => {
            if (event.key === 'Enter') take();
            if (event.key === 'Escape') setEntry(null);
          }}
        />
        {units.value}
      </span>
      {parsedM === null && <span class="field-fault">{t('Type a number, as {shown}', { shown })}</span>}
    </label>
  );
}
