/** Walking through the building at eye height. */
import { type Signal, signal } from '@preact/signals';

export interface WalkState {
  readonly isWalking: Signal<boolean>;
  /** The address asks for a walk from where it puts the camera. */
  readonly startsWalking: Signal<boolean>;
}

export const createWalkState = (): WalkState => ({ isWalking: signal(false), startsWalking: signal(false) });
