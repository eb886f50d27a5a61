import { defineConfig } from 'vite';

export default defineConfig({
  // Relative addresses: the build is also shown below a folder and by static hosts.
  base: './',
  build: {
    target: 'es2022',
    // three.js alone is above the default limit; the page comes from the same machine.
    chunkSizeWarningLimit: 1200,
    // Inlined data: addresses would need exceptions in the content security policy.
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
  },
  server: {
    // `npm run dev` shows the plan that `tlsplan view plan/ --port 8000` serves.
    proxy: { '/plan': { target: 'http://127.0.0.1:8000', changeOrigin: true } },
  },
});
