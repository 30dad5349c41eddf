import { fileURLToPath } from "node:url";
import { defineConfig } from "vite";

const here = (path: string) => fileURLToPath(new URL(path, import.meta.url));

/** Names without hashes: what is built is committed, and a server adds its own validators. */
const names = {
  entryFileNames: "assets/[name].js",
  chunkFileNames: "assets/[name].js",
  assetFileNames: "assets/[name][extname]",
};

export default defineConfig({
  root: here("viewer"),
  // The page works from any folder of any server.
  base: "./",
  resolve: {
    alias: [{ find: /^tercet(\/(.*))?$/, replacement: here("dist") + "/$2", customResolver: undefined }],
  },
  build: {
    outDir: here("../crates/tercet-cli/assets/viewer"),
    emptyOutDir: true,
    target: "es2022",
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    rolldownOptions: { output: names },
  },
  worker: { format: "es", rolldownOptions: { output: names } },
});
