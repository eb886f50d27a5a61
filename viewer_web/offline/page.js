/**
 * Part of the page of an exported plan: has the browser keep the plan on the device, and says how far it is.
 *
 * A classic script, so that it runs, and can say what to do, where the folder is opened without a web server.
 * `data-offline` of the root element: keeping, ready, failed, unavailable.
 */
(() => {
  const SHOWN_MS = 6000;
  // As src/language/language.ts: what was chosen, or the browser's. Where pages can keep nothing, it throws.
  function isGerman() {
    try {
      const known = [localStorage.getItem('tlsplan-language'), ...navigator.languages.map((tag) => tag.split('-')[0])];
      return known.find((name) => name === 'de' || name === 'en') === 'de';
    } catch {
      return false;
    }
  }
  const inGerman = isGerman();
  const words = (english, german) => (inGerman ? german : english);
  const bar = document.createElement('div');
  let hiding = 0;

  function say(text, { action, stays = false } = {}) {
    clearTimeout(hiding);
    bar.textContent = text;
    bar.setAttribute('role', 'status');
    Object.assign(bar.style, {
      position: 'fixed',
      bottom: '1rem',
      // The legend is on the left.
      right: '1rem',
      zIndex: '1000',
      maxWidth: '90vw',
      padding: '0.5rem 1rem',
      borderRadius: '0.5rem',
      background: '#1d2733',
      color: '#fff',
      font: '0.95rem/1.4 system-ui, sans-serif',
    });
    if (action) {
      const button = document.createElement('button');
      button.textContent = action.label;
      Object.assign(button.style, { marginLeft: '1rem', font: 'inherit', padding: '0.25rem 0.75rem' });
      button.addEventListener('click', action.act);
      bar.append(button);
    }
    document.body.append(bar);
    if (!stays) hiding = setTimeout(() => bar.remove(), SHOWN_MS);
  }

  function state(word) {
    document.documentElement.dataset.offline = word;
  }

  if (location.protocol === 'file:') {
    state('unavailable');
    say(
      words(
        'A browser shows this plan only from a web server. In this folder run: python3 -m http.server 8000, then open ' +
          'http://localhost:8000/ - or put the folder on any web host.',
        'Ein Browser zeigt diesen Plan nur von einem Webserver. In diesem Ordner: python3 -m http.server 8000, dann ' +
          'http://localhost:8000/ öffnen - oder den Ordner auf einen Webserver legen.',
      ),
      { stays: true },
    );
    return;
  }
  if (!('serviceWorker' in navigator)) {
    state('unavailable'); // plain http, or a private window: everything but working without network is there
    return;
  }

  let reloads = false;
  navigator.serviceWorker.addEventListener('controllerchange', () => {
    if (reloads) location.reload();
  });
  navigator.serviceWorker.addEventListener('message', ({ data }) => {
    if (data?.kept && document.documentElement.dataset.offline === 'keeping' && data.kept < data.files) {
      const { kept, files } = data;
      say(
        words(
          `Keeping the plan on this device: ${kept} of ${files} files`,
          `Der Plan wird auf diesem Gerät gespeichert: ${kept} von ${files} Dateien`,
        ),
      );
    }
  });

  function offer(worker) {
    const act = () => {
      reloads = true;
      worker.postMessage('take over');
    };
    const action = { label: words('Show it', 'Zeigen'), act };
    say(words('There is a newer plan.', 'Es gibt einen neueren Plan.'), { action, stays: true });
  }

  function follow(worker, isFirst) {
    worker.addEventListener('statechange', () => {
      if (worker.state === 'installed' && !isFirst) offer(worker);
      if (worker.state === 'activated' && isFirst) {
        state('ready');
        say(
          words(
            'The plan is on this device now and opens without network.',
            'Der Plan ist jetzt auf diesem Gerät und öffnet sich ohne Netz.',
          ),
        );
      }
      if (worker.state === 'redundant' && isFirst) {
        state('failed');
        say(
          words(
            'This device could not keep the plan: it needs the network. Is there space left?',
            'Dieses Gerät konnte den Plan nicht speichern: Er braucht das Netz. Ist noch Platz?',
          ),
        );
      }
    });
  }

  async function keep() {
    const isFirst = navigator.serviceWorker.controller === null;
    state(isFirst ? 'keeping' : 'ready');
    const registration = await navigator.serviceWorker.register('worker.js', { updateViaCache: 'none' });
    if (registration.active && !registration.installing) state('ready'); // a reload past the worker
    if (registration.waiting) offer(registration.waiting);
    if (registration.installing) follow(registration.installing, isFirst);
    registration.addEventListener('updatefound', () => {
      if (registration.installing) follow(registration.installing, registration.active === null);
    });
  }

  keep().catch((error) => {
    state('failed');
    const why = error.message;
    say(
      words(
        `This plan needs the network: it could not be kept on this device (${why}).`,
        `Dieser Plan braucht das Netz: Er ließ sich auf diesem Gerät nicht speichern (${why}).`,
      ),
    );
  });
})();
