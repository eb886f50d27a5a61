/** Prepares a stage in a thread of its own. */
import { t } from '../language/language.ts';
import { PlanLoadError } from './plan-load-error.ts';
import type { PreparedStage } from './prepare-stage.ts';
import type { Answer } from './stage-worker.ts';

/** Takes the bytes: they are of no more use to the caller. */
export function prepareBeside(bytes: ArrayBuffer): Promise<PreparedStage> {
  const worker = new Worker(new URL('./stage-worker.ts', import.meta.url), { type: 'module' });
  return new Promise<PreparedStage>((resolve, reject) => {
    worker.onmessage = ({ data }: MessageEvent<Answer>) => {
      if (data.kind === 'prepared') resolve(data.prepared);
      else reject(data.isPlanFault ? new PlanLoadError(data.message) : new Error(data.message));
    };
    worker.onerror = ({ message }) => {
      reject(
        new Error(
          t("The building can't be prepared: {why}.", { why: message || t('the browser runs no module workers') }),
        ),
      );
    };
    worker.postMessage(bytes, [bytes]);
  }).finally(() => worker.terminate());
}
