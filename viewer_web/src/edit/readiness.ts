/** What can be done right now, and in words what to do where something can't. */

import { NO_ANSWER } from '../api/api-error.ts';
import type { ReviewClient } from '../api/review-client.ts';
import { t } from '../language/language.ts';
import { OWN_PLAN } from '../load/plan-base.ts';
import { percent } from '../panels/figures.ts';
import type { Store } from '../store.ts';
import type { Tool } from './state.ts';

/** The live side computes. */
export function isLive(store: Store): boolean {
  return store.reviewClient?.live.value.state === 'ready';
}

/** Said beside what commenters can't do. */
export const COMMENT_ONLY = t(
  'This address is for comments and verdicts. To edit stations, plan again or sign off, ask for the other address that `tlsplan view` printed.',
);

/** All changes of the review are taken. */
export function canEdit(store: Store): boolean {
  return (store.reviewClient?.canEdit.value ?? false) && store.planBase.value === OWN_PLAN;
}

/** Comments and verdicts are taken. */
export function canComment(store: Store): boolean {
  return (store.reviewClient?.canComment.value ?? false) && store.planBase.value === OWN_PLAN;
}

/** Why the server's side is missing, in words; null: it is there. */
export function whyNoServer({ line, session, fault }: ReviewClient): string | null {
  if (session.value !== null) return null;
  if (line.value === 'connecting') return t('Connecting to the server …');
  if (line.value === 'none') {
    return t(
      'This server only shows files. Start `tlsplan view` of this version to change the plan and to plan again.',
    );
  }
  return fault.value ?? NO_ANSWER;
}

/** Why stations and areas are not changed, nor the plan signed off; null: they are. */
export function whyNoEditing(store: Store): string | null {
  return whyNoComments(store) ?? (store.reviewClient?.session.value?.comment_only ? COMMENT_ONLY : null);
}

/** Why not even comments and verdicts are taken; null: they are. */
export function whyNoComments(store: Store): string | null {
  const { reviewClient } = store;
  if (reviewClient === null) return t('This is a read-only copy. Open the plan with `tlsplan view` to change it.');
  if (store.planBase.value !== OWN_PLAN) {
    return t('This is the plan of a run. Go back to the main plan to edit.');
  }
  const missing = whyNoServer(reviewClient);
  if (missing !== null) return missing;
  if (reviewClient.session.value?.read_only) {
    return t('The server was started with --read-only. Restart it without this option to change the plan.');
  }
  if (!reviewClient.canComment.value) return reviewClient.fault.value ?? NO_ANSWER;
  return null;
}

/** Why moving shows no figures; null: it does. */
export function whyNotLive(store: Store): string | null {
  const live = store.reviewClient?.live.value;
  if (live === undefined || live.state === 'ready') return null;
  if (live.state === 'starting') {
    const share = live.fraction === null || live.fraction === undefined ? '' : `, ${percent(live.fraction, 0)}`;
    return t('Preparing live editing: {step}', { step: `${live.step || t('loading the scene')}${share}` });
  }
  const said = live.message ? `${live.message.replace(/[.\s]+$/, '')}. ` : '';
  if (live.state === 'failed') return `${said}${t('To move stations, fix this and restart the server.')}`;
  return `${said}${t('To move stations, start the server with the scene: tlsplan view plan/ --scene building.ifc')}`;
}

/** The tool that the pointer works with on the tab that is shown; null: it only looks around. */
export function toolInHand(store: Store): Tool | null {
  const tool = store.editing.tool.value;
  if (store.tab.value === 'edit') return !canEdit(store) ? null : tool === 'comment' ? 'select' : tool;
  return store.tab.value === 'review' && tool === 'comment' && canComment(store) ? tool : null;
}
