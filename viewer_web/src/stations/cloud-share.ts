/** What share of a scan is drawn: nobody is to take a thinned cloud for all that the scanner sees. */
import { plain, t } from '../language/language.ts';
import { reachedPercent, whole } from '../panels/figures.ts';

/** Beams of one scan. */
export function beamsOfScan({
  n_azimuths,
  n_channels,
}: {
  readonly n_azimuths: number;
  readonly n_channels: number;
}): number {
  return n_azimuths * n_channels;
}

/** `all beams`, `78.0 % of the beams`, `1 beam in 240`. */
export function shareInWords(nBeams: number, nScanned: number): string {
  if (nBeams >= nScanned) return t('all beams');
  const oneIn = nScanned / nBeams;
  if (oneIn < 1.95) return t('{percent} of the beams', { percent: reachedPercent(nBeams / nScanned, 1) });
  return t('1 beam in {n}', { n: oneIn < 9.95 ? plain(Number(oneIn.toFixed(1))) : whole(Math.round(oneIn)) });
}
