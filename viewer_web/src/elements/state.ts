/** Whether the clicked element is drawn alone, or seen through the others. */
import { type Signal, signal } from '@preact/signals';

/** `xray`: of the others only the edges are drawn. */
export type Isolation = 'none' | 'alone' | 'xray';

export interface ElementState {
  readonly isolation: Signal<Isolation>;
}

export const createElementState = (): ElementState => ({ isolation: signal<Isolation>('none') });
