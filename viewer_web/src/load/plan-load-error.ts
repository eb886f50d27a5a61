/** A plan that can't be shown; the message is one line for the user: what, got, expected, remedy. */
export class PlanLoadError extends Error {
  override readonly name = 'PlanLoadError';
}

/** A file that the plan folder does not have. */
export class MissingFileError extends PlanLoadError {}
