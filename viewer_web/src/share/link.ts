/** A link to what is shown: the address, with the camera as it stands. */
import { formatUrlState, parseUrlState, type UrlState } from '../url-state.ts';

/** `camera`: position and target, local metres. The address itself has it only once somebody moved it. */
export function linkTo(location: Pick<Location, 'origin' | 'pathname' | 'hash'>, camera: readonly number[]): string {
  return linkOf(location, { ...parseUrlState(location.hash), camera });
}

export const linkOf = ({ origin, pathname }: Pick<Location, 'origin' | 'pathname'>, state: UrlState): string =>
  origin + pathname + formatUrlState(state);

/** Whether the clipboard took it: browsers give it to pages of this machine and to https alone. */
export async function copied(text: string, clipboard: Pick<Clipboard, 'writeText'> | undefined): Promise<boolean> {
  try {
    if (clipboard === undefined) return false;
    await clipboard.writeText(text);
    return true;
  } catch {
    return false;
  }
}
