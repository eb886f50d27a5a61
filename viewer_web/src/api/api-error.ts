import { t } from '../language/language.ts';

export const NO_ANSWER = t(
  'The server does not answer. Is `tlsplan view` still running? Changes made now are not kept.',
);
/** For whoever has no token: the cookie of another start of the server, or none. */
export const NO_TOKEN = t(
  'The server was started again, or this is another browser: open the address that `tlsplan view` printed.',
);

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
