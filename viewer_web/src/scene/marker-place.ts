/** Where a marker lies on the canvas, in CSS pixels. */
export interface MarkerPlace {
  readonly x: number;
  readonly y: number;
  readonly isHidden: boolean;
  /** The other floor that hides it; null: none does. */
  readonly coveredBy: string | null;
}
