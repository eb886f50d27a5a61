/** Which page, tab and sheet are open. */
import { type Signal, signal } from '@preact/signals';

export type PageId = 'plan' | 'field' | 'drawing';
export const TAB_IDS = ['plan', 'unseen', 'network', 'edit', 'runs', 'review'] as const;
export type TabId = (typeof TAB_IDS)[number];
/** What the sheet over the canvas shows. */
export type SheetId = 'graph' | 'matrix' | 'panorama';

export interface PanelState {
  /** The whole plan, what is needed in the field, or the drawing that it was made from. */
  readonly page: Signal<PageId>;
  /** Which page of the sidebar. */
  readonly tab: Signal<TabId>;
  readonly sheet: Signal<SheetId | null>;
  readonly isSidebarOpen: Signal<boolean>;
}

export function createPanelState(): PanelState {
  return {
    page: signal<PageId>('plan'),
    tab: signal<TabId>('plan'),
    sheet: signal<SheetId | null>(null),
    isSidebarOpen: signal(true),
  };
}
