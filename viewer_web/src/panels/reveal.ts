/**
 * Bring the chosen row of a list into sight. In narrow windows lists scroll with the page: there it goes back to the picture above
 * them, which shows what was chosen.
 */
export function reveal(row: HTMLElement | null): void {
  const panel = row?.closest('.sidebar');
  if (!row || !panel) return;
  if (getComputedStyle(panel).overflowY !== 'visible') row.scrollIntoView({ block: 'nearest' });
  else panel.closest('.workspace')?.scrollTo({ top: 0 });
}
