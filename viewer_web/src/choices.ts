/** Choosing: one thing is chosen at a time (a station, a pair of them, an unseen piece, a room, or a surface), and its floor with it. */
import { batch, effect, untracked } from '@preact/signals';
import type { FileState } from './files/state.ts';
import { floorBeside, highestCutM } from './floors/cut.ts';
import type { FloorState } from './floors/state.ts';
import type { LoadState } from './load/state.ts';
import type { NetworkState, Pair } from './network/state.ts';
import type { PanelState } from './panels/state.ts';
import type { RoomState } from './rooms/state.ts';
import type { Picked, SceneState } from './scene/state.ts';
import type { StationState } from './stations/state.ts';
import type { UnseenFocus, UnseenState } from './unseen/state.ts';

export interface Choices {
  chooseFloor(floorId: string | null): void;
  stepFloor(step: number): void;
  chooseStation(stationId: string | null): void;
  stepStation(step: number): void;
  choosePair(pair: Pair | null): void;
  lookAtUnseen(focus: UnseenFocus | null): void;
  /** By its number in layers.json. */
  chooseRoom(number: number | null): void;
  pick(picked: Picked | null): void;
  /** Switch a file of a scene of several on or off. */
  showFile(file: number, isShown: boolean): void;
  clear(): void;
}

type Chosen = LoadState &
  FloorState &
  FileState &
  StationState &
  NetworkState &
  UnseenState &
  RoomState &
  SceneState &
  PanelState;

/** So much above a piece that is looked at the floor is cut. */
const CUT_ABOVE_M = 0.1;

export function createChoices(state: Chosen): Choices {
  const { loaded, floorId, isSpread, cutM, stationId, shownStations, pair, unseenFocus, picked, sheet, hiddenFiles } =
    state;

  /** The cut as it was before a piece above it was looked at, and as it was raised for that. */
  let cutBefore: { readonly chosenM: number; readonly raisedM: number } | null = null;
  const raiseCut = (toM: number): void => {
    if (toM <= cutM.value) return;
    cutBefore = { chosenM: cutM.value, raisedM: toM };
    cutM.value = toM;
  };
  const lowerCut = (): void => {
    // Whoever moved the slider meanwhile wants it there.
    if (cutBefore !== null && cutM.value === cutBefore.raisedM) cutM.value = cutBefore.chosenM;
    cutBefore = null;
  };
  const letGo = (): void => {
    lowerCut();
    stationId.value = null;
    state.showsOwn.value = false;
    state.ownRequirement.value = null;
    pair.value = null;
    unseenFocus.value = null;
    state.roomNumber.value = null;
    picked.value = null;
  };
  const chooseFloor = (id: string | null): void =>
    batch(() => {
      floorId.value = id;
      const station = shownStations.value.find(({ id }) => id === stationId.value);
      if (id !== null && station !== undefined && station.floorId !== id) stationId.value = null;
      picked.value = null;
      if (unseenFocus.value !== null) lowerCut();
      unseenFocus.value = null;
      state.roomNumber.value = null;
    });
  const chooseStation = (id: string | null): void =>
    batch(() => {
      letGo();
      stationId.value = id;
      const station = shownStations.value.find((candidate) => candidate.id === id);
      // Its floor alone: among spread floors the one above would hide it.
      if (station !== undefined) floorId.value = station.floorId;
    });
  const choosePair = (chosen: Pair | null): void =>
    batch(() => {
      letGo();
      pair.value = chosen;
      const floors = new Set(shownStations.value.filter(({ id }) => chosen?.includes(id)).map((one) => one.floorId));
      const [first] = floors;
      if (first !== undefined) floorId.value = floors.size === 1 ? first : null;
    });
  const showFile = (file: number, isShown: boolean): void =>
    batch(() => {
      if (hiddenFiles.value.has(file) !== isShown) return;
      const hidden = new Set(hiddenFiles.value);
      if (isShown) hidden.delete(file);
      else hidden.add(file);
      hiddenFiles.value = hidden;
      if (picked.value !== null && hidden.has(picked.value.element.file)) picked.value = null;
    });
  const lookAtUnseen = (focus: UnseenFocus | null): void =>
    batch(() => {
      letGo();
      unseenFocus.value = focus;
      if (focus === null) return;
      const element = loaded.value?.stage.elements.find(({ sceneIndex }) => sceneIndex === focus.surface.element);
      if (element !== undefined) showFile(element.file, true);
      const piece = focus.surface.pieces[focus.piece];
      const floor = loaded.value?.stage.floors.find(({ id }) => id === focus.surface.floor);
      floorId.value = floor?.id ?? null;
      if (floor === undefined) isSpread.value = false;
      // What lies above the cut is not drawn.
      else if (piece !== undefined) {
        const topM = piece.box[1][2] - (loaded.value?.stage.offsetM[2] ?? 0) - floor.elevationM;
        raiseCut(Math.min(topM + CUT_ABOVE_M, highestCutM(floor)));
      }
    });
  const chooseRoom = (number: number | null): void =>
    batch(() => {
      letGo();
      state.roomNumber.value = number;
      const room = number === null ? undefined : loaded.value?.layers?.rooms?.list[number];
      const floor = loaded.value?.stage.floors.find(({ id }) => id === room?.floor);
      if (floor !== undefined) floorId.value = floor.id;
    });
  const stepStation = (step: number): void => {
    const stations = shownStations.value;
    const shown = floorId.value === null ? stations : stations.filter((station) => station.floorId === floorId.value);
    if (shown.length === 0) return;
    const at = shown.findIndex(({ id }) => id === stationId.value);
    const next = at < 0 ? (step > 0 ? 0 : shown.length - 1) : (at + step + shown.length) % shown.length;
    chooseStation(shown[next].id);
  };

  // A piece above the cut, as a ceiling, was shown for being looked at: stations are not edited through it.
  effect(() => {
    if (state.tab.value === 'edit' && cutBefore !== null) untracked(letGo);
  });

  return {
    chooseFloor,
    stepFloor: (step) => chooseFloor(floorBeside(floorId.value, step, loaded.value?.stage.floors ?? [])),
    chooseStation,
    stepStation,
    choosePair,
    lookAtUnseen,
    chooseRoom,
    showFile,
    pick: (surface) => {
      picked.value = surface;
    },
    clear: () =>
      batch(() => {
        if (sheet.value !== null) {
          sheet.value = null;
          return;
        }
        if (state.selection.value.size > 0 || state.selectsSeveral.value) {
          state.selection.value = new Set();
          state.selectsSeveral.value = false;
          return;
        }
        const isNothingChosen = [picked, stationId, pair, unseenFocus, state.roomNumber].every(
          ({ value }) => value === null,
        );
        if (isNothingChosen) floorId.value = null;
        letGo();
      }),
  };
}
