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
    // One file: what is set for narrow windows and for paper has to come last, whatever is loaded when.
    cssCodeSplit: false,
    modulePreload: false,
  },
  // As the page's scripts: texts of a language are a file of their own.
  worker: { format: 'es' },
  server: {
    // `npm run dev` shows the plan that `tlsplan view plan/ --port 8000` serves.
    proxy: { '/plan': { target: 'http://127.0.0.1:8000', changeOrigin: true } },
  },
});
