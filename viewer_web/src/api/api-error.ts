/** What the server, or the way to it, says no with; `message` is for people. */
export class ApiError extends Error {
  constructor(
    /** The HTTP status; 0: no answer, or none that can be read. */
    readonly status: number,
    message: string,
  ) {
    super(message);
  }
}
