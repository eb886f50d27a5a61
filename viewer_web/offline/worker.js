/**
 * Service worker of an exported plan: keeps all of it on the device, and answers from there.
 *
 * The export writes `const EXPORTED = {digest, files: [[path, sha256], ...]}` before this text. A new export is another
 * text, so the browser fetches it beside the one that answers; it takes over when the page says so, or when no page is
 * open any more: one page never shows files of two exports.
 */
const SCOPE = self.registration.scope;
// Plans below one address share its store: each deletes only its own.
const OWN = `tlsplan ${SCOPE} `;
const STORE = OWN + EXPORTED.digest;
const SHA256 = 'x-tlsplan-sha256';
const AT_ONCE = 4;

self.addEventListener('install', (event) => event.waitUntil(keepAll()));
self.addEventListener('activate', (event) => event.waitUntil(takeOver()));
self.addEventListener('message', (event) => {
  if (event.data === 'take over') self.skipWaiting();
});
self.addEventListener('fetch', (event) => {
  const { method, url } = event.request;
  if (method === 'GET' && url.startsWith(SCOPE)) event.respondWith(answer(event.request));
});

/** Fetch every file and keep it; all of them, or the browser tries again another time. */
async function keepAll() {
  const store = await caches.open(STORE);
  const olderNames = (await caches.keys()).filter((name) => name.startsWith(OWN) && name !== STORE);
  const older = await Promise.all(olderNames.map((name) => caches.open(name)));
  const left = [...EXPORTED.files];
  let kept = 0;
  const keepSome = async () => {
    for (let file = left.shift(); file !== undefined; file = left.shift()) {
      await keep(store, older, ...file);
      kept += 1;
      await tell({ kept, files: EXPORTED.files.length });
    }
  };
  await Promise.all(Array.from({ length: AT_ONCE }, keepSome));
}

async function keep(store, older, path, sha256) {
  const address = addressOf(path);
  for (const other of [store, ...older]) {
    const known = await other.match(address);
    if (known?.headers.get(SHA256) === sha256) {
      if (other !== store) await store.put(address, known);
      return;
    }
  }
  // Hosts send `index.html` on to the folder.
  const response = await fetch(path === 'index.html' ? SCOPE : address, { cache: 'no-cache' });
  if (!response.ok) throw new Error(`${path}: the host answers ${response.status}`);
  const bytes = await response.arrayBuffer();
  // What belongs to the plan must be of this export; pages and scripts some hosts shrink on the way.
  if (path.startsWith('plan/') && (await sha256Of(bytes)) !== sha256) throw new Error(`${path}: is of another export`);
  const type = response.headers.get('content-type') ?? 'application/octet-stream';
  await store.put(address, new Response(bytes, { headers: { 'content-type': type, [SHA256]: sha256 } }));
}

async function takeOver() {
  const names = (await caches.keys()).filter((name) => name.startsWith(OWN) && name !== STORE);
  await Promise.all(names.map((name) => caches.delete(name)));
  await self.clients.claim();
}

/** What is kept, else what the host says: the device may have thrown files away. */
async function answer(request) {
  const address = new URL(request.url);
  address.search = '';
  address.hash = '';
  if (address.href === SCOPE) address.pathname += 'index.html';
  const store = await caches.open(STORE);
  return (await store.match(address.href)) ?? fetch(request);
}

function addressOf(path) {
  return new URL(path.split('/').map(encodeURIComponent).join('/'), SCOPE).href;
}

async function sha256Of(bytes) {
  const digest = new Uint8Array(await crypto.subtle.digest('SHA-256', bytes));
  return Array.from(digest, (byte) => byte.toString(16).padStart(2, '0')).join('');
}

async function tell(message) {
  for (const client of await self.clients.matchAll({ includeUncontrolled: true })) client.postMessage(message);
}
