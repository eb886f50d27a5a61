/** What Escape closes: of all that lies over the page the last that was opened, and nothing else with the same stroke. */
const layers: (() => void)[] = [];

/** Have Escape close what was opened now; returns what takes it off again. */
export function closeOnEscape(close: () => void): () => void {
  layers.push(close);
  return () => {
    const at = layers.lastIndexOf(close);
    if (at >= 0) layers.splice(at, 1);
  };
}

/** Has to listen before all others that know Escape. Returns what stops listening. */
export function listenToEscape(target: Pick<Window, 'addEventListener' | 'removeEventListener'>): () => void {
  const onKey = (event: KeyboardEvent): void => {
    if (event.key !== 'Escape' || layers.length === 0) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    layers[layers.length - 1]();
  };
  target.addEventListener('keydown', onKey, { capture: true });
  return () => target.removeEventListener('keydown', onKey, { capture: true });
}
