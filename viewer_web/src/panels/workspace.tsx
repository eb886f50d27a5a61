/** The plan in 3D with all its panels: a part of the application of its own, which the field view does without. */

import { useEffect, useRef, useState } from 'preact/hooks';
import { DrawingButton } from '../drawing/drawing-button.tsx';
import { DraftBar } from '../edit/draft-bar.tsx';
import { EditLayer } from '../edit/edit-layer.tsx';
import { Messages } from '../edit/messages.tsx';
import { SelectionCard } from '../edit/selection-card.tsx';
import { WhatIfCard } from '../edit/what-if-card.tsx';
import { FieldButton } from '../field/field-button.tsx';
import { GhostCard } from '../ghost/ghost-card.tsx';
import { GhostMarker } from '../ghost/ghost-marker.tsx';
import { Legend } from '../heat/legend.tsx';
import { t } from '../language/language.ts';
import { LanguageSelect } from '../language/language-select.tsx';
import type { LoadedPlan } from '../load/fetch-plan.ts';
import { MeasureLayer } from '../measure/measure-layer.tsx';
import { PlanScale } from '../measure/plan-grid.tsx';
import { SiteTools } from '../measure/site-tools.tsx';
import { PairCard } from '../network/pair-card.tsx';
import { People } from '../review/people.tsx';
import { RoomNames } from '../rooms/room-names.tsx';
import { RunBanner } from '../runs/run-banner.tsx';
import { FlatPicture } from '../scene/flat-picture.tsx';
import { PlanView } from '../scene/plan-view.ts';
import { CoveredNote } from '../stations/covered-note.tsx';
import { Markers } from '../stations/markers.tsx';
import { StationCard } from '../stations/station-card.tsx';
import type { Store } from '../store.ts';
import { ViewCube } from '../views/view-cube.tsx';
import { WalkMap } from '../walk/walk-map.tsx';
import { WalkPanel } from '../walk/walk-panel.tsx';
import { KeyCursor } from './key-cursor.tsx';
import { listenToKeys } from './keys.ts';
import { printPicture } from './print-picture.ts';
import { Sheet } from './sheet.tsx';
import { SurfaceCard } from './surface-card.tsx';
import { Tabs } from './tabs.tsx';
import { Toolbar } from './toolbar.tsx';

export function Workspace({ store, loaded }: { store: Store; loaded: LoadedPlan }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const [view, setView] = useState<PlanView | null>(null);
  useEffect(() => {
    if (canvas.current === null) return undefined;
    const shown = new PlanView(canvas.current, store, loaded);
    const stopKeys = listenToKeys(window, store, shown);
    const stopPrint = printPicture(window, canvas.current, shown);
    setView(shown);
    return () => {
      stopKeys();
      stopPrint();
      shown.dispose();
    };
  }, [store, loaded]);
  const hasPicture = store.hasPicture.value;
  return (
    <div class={store.isSidebarOpen.value ? 'workspace' : 'workspace workspace-wide'}>
      <nav class="sidebar" aria-label={t('Plan')}>
        <header class="brand">
          <img src="icon.svg" alt="" width="28" height="28" />
          <div>
            <h1>tlsplan</h1>
            <p class="muted" title={loaded.plan.scene.file}>
              {loaded.plan.scene.file.split(/[\\/]/).pop()}
            </p>
          </div>
          <LanguageSelect />
          <FieldButton store={store} />
        </header>
        {store.reviewClient !== null && <People reviewClient={store.reviewClient} />}
        <DrawingButton store={store} />
        <Tabs store={store} view={view} />
      </nav>
      <main class="stage">
        {!hasPicture && (
          <p class="no-picture" role="status">
            {t(
              'This browser shows no 3D picture. Switch on hardware acceleration (WebGL 2) and load the page again, or use another browser. What needs the picture is greyed out.',
            )}
          </p>
        )}
        {view !== null && <RunBanner store={store} />}
        {view !== null && <DraftBar store={store} />}
        <div class="scene">
          <canvas
            ref={canvas}
            tabIndex={0}
            aria-label={
              hasPicture
                ? t(
                    'The building in 3D. Drag to rotate, scroll to zoom, click a floor to open it. By keys: Q and E turn, R and F tilt, plus and minus zoom, arrows move a cross, Space clicks there.',
                  )
                : t(
                    'The floor plan. Drag to shift, scroll to zoom, click a floor to open it. By keys: plus and minus zoom, arrows move a cross, Space clicks there.',
                  )
            }
          />
          {view !== null && !hasPicture && <FlatPicture store={store} loaded={loaded} view={view} />}
          {view !== null && <MeasureLayer store={store} loaded={loaded} view={view} />}
          {view !== null && store.measuring.tool.value === null && <KeyCursor canvas={canvas} />}
          {view !== null && <RoomNames store={store} view={view} />}
          {view !== null && <Markers store={store} view={view} />}
          {view !== null && <GhostMarker store={store} loaded={loaded} view={view} />}
          {view !== null && <Toolbar store={store} view={view} />}
          {view !== null && <EditLayer store={store} loaded={loaded} view={view} />}
          {view !== null && <SiteTools store={store} view={view} />}
          {view !== null && <WalkMap store={store} loaded={loaded} view={view} />}
          {view !== null && <ViewCube store={store} scene={loaded.plan.scene} view={view} />}
          <div class="corner">
            {view !== null && <PlanScale store={store} view={view} />}
            {view !== null && <CoveredNote store={store} view={view} />}
            {hasPicture && <Legend store={store} />}
            {view !== null && <WalkPanel store={store} view={view} />}
          </div>
          <div class="cards">
            {showsStationCard(store) && <StationCard store={store} view={view} />}
            <WhatIfCard store={store} />
            <GhostCard store={store} loaded={loaded} />
            <SelectionCard store={store} />
            <PairCard store={store} />
            <SurfaceCard store={store} view={view} />
          </div>
        </div>
        <Sheet store={store} view={view} />
      </main>
      {store.reviewClient !== null && <Messages reviewClient={store.reviewClient} />}
    </div>
  );
}

/** Not while walking or editing, nor of a station that is not shown, as while a run is watched. */
function showsStationCard({ isWalking, tab, stationId, shownStations }: Store): boolean {
  const isShown = shownStations.value.some(({ id }) => id === stationId.value);
  return isShown && !isWalking.value && tab.value !== 'edit';
}
