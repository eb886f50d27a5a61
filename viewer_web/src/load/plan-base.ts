/**
 * Where the files of a plan are asked for: `plan/` beside the page, below which other plans of the folder lie.
 *
 * Addresses are relative to the page, so that the same build works on the server, below a folder and from a static host.
 */

/** The plan the page was started for; others are named like `runs/R001/plan`. */
export const OWN_PLAN = '';

const FOLDER = /^[A-Za-z0-9_-][A-Za-z0-9._-]*(\/[A-Za-z0-9_-][A-Za-z0-9._-]*)*$/;

/** Address of a file of the plan folder `base`. */
export function planUrl(base: string, path: string): string {
  return base === OWN_PLAN ? `plan/${path}` : `plan/${base}/${path}`;
}

/** A plan folder as an address names it; the own plan where it names none or leads elsewhere. */
export function planBaseOf(named: string | null): string {
  return named !== null && FOLDER.test(named) ? named : OWN_PLAN;
}
