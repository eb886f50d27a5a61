/** The one store: the state of each feature, under one roof. The panels and the 3D side read the same signals. */
import type { ReviewClient } from './api/review-client.ts';
import { type Choices, createChoices } from './choices.ts';
import { type CompareState, createCompareState } from './compare/state.ts';
import { DrawingEditor } from './drawing/editor.ts';
import { createEditing, type Editing } from './edit/state.ts';
import { createElementState, type ElementState } from './elements/state.ts';
import { createFileState, type FileState } from './files/state.ts';
import { createFloorState, type FloorState } from './floors/state.ts';
import { createGhostState, type GhostState } from './ghost/state.ts';
import { createHeatState, type HeatState } from './heat/state.ts';
import { createLoadState, type LoadState } from './load/state.ts';
import { createMeasureState, type MeasureState } from './measure/state.ts';
import { createNetworkState, type NetworkState } from './network/state.ts';
import { createPanelState, type PanelState } from './panels/state.ts';
import { createRoomState, type RoomState } from './rooms/state.ts';
import { createRouteState, type RouteState } from './route/state.ts';
import { createSceneState, type SceneState } from './scene/state.ts';
import { createSectionState, type SectionState } from './section/state.ts';
import { createSightState, type SightState } from './sights/state.ts';
import { createStationState, type StationState } from './stations/state.ts';
import { createUnseenState, type UnseenState } from './unseen/state.ts';
import { createWalkState, type WalkState } from './walk/state.ts';

export interface Store
  extends LoadState,
    PanelState,
    FloorState,
    ElementState,
    FileState,
    GhostState,
    HeatState,
    StationState,
    NetworkState,
    UnseenState,
    WalkState,
    RoomState,
    RouteState,
    SceneState,
    SectionState,
    MeasureState,
    SightState,
    CompareState,
    Choices {
  /** The page only shows files: nothing that needs the server behind them. */
  readonly isStatic: boolean;
  /** What the server knows beyond files; null: there is no such server. */
  readonly reviewClient: ReviewClient | null;
  /** The drawing that the plan was made from; null: there is no server that has it. */
  readonly drawing: DrawingEditor | null;
  /** What is being edited and not committed yet. */
  readonly editing: Editing;
}

interface StoreOptions {
  readonly isStatic?: boolean;
  readonly reviewClient?: ReviewClient | null;
}

export function createStore({ isStatic = false, reviewClient = null }: StoreOptions = {}): Store {
  const load = createLoadState();
  const walk = createWalkState();
  const stations = createStationState(load);
  const section = createSectionState();
  const state = {
    ...load,
    ...walk,
    ...stations,
    ...section,
    ...createFloorState(load, walk, section),
    ...createElementState(),
    ...createFileState(),
    ...createGhostState(),
    ...createHeatState(load),
    ...createNetworkState(load, stations),
    ...createRoomState(),
    ...createRouteState(load),
    ...createUnseenState(),
    ...createSceneState(),
    ...createMeasureState(),
    ...createSightState(),
    ...createPanelState(),
    ...createCompareState(),
  };
  const drawing = reviewClient === null ? null : new DrawingEditor(reviewClient.client);
  return { ...state, ...createChoices(state), isStatic, reviewClient, drawing, editing: createEditing() };
}
