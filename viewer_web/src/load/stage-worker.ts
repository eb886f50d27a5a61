/** The thread that prepares a stage, so that the page answers meanwhile. In: the bytes of stage.usdc; out: `Answer`. */
import { PlanLoadError } from './plan-load-error.ts';
import { buffersOf, type PreparedStage, prepareStage } from './prepare-stage.ts';

/** `isPlanFault`: the plan is at fault, not we. */
export type Answer =
  | { readonly kind: 'prepared'; readonly prepared: PreparedStage }
  | { readonly kind: 'failed'; readonly message: string; readonly isPlanFault: boolean };

// The types of a worker's own scope clash with those of a page.
const scope = globalThis as unknown as {
  onmessage: (event: MessageEvent<ArrayBuffer>) => void;
  postMessage(answer: Answer, transfer: Transferable[]): void;
};

scope.onmessage = ({ data }) => {
  try {
    const prepared = prepareStage(data);
    scope.postMessage({ kind: 'prepared', prepared }, buffersOf(prepared));
  } catch (error) {
    const isPlanFault = error instanceof PlanLoadError;
    scope.postMessage({ kind: 'failed', message: (error as Error).message, isPlanFault }, []);
  }
};
