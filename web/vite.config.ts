import { fileURLToPath } from "node:url";
import { defineConfig } from "vite";

const path = (file: string) => fileURLToPath(new URL(file, import.meta.url));

// `--mode single`: everything in one script, which the build puts into the page.
export default defineConfig(({ mode }) => {
  const single = mode === "single";
  return {
    base: "./",
    resolve: { alias: { "#assets": path(single ? "page/assets-single.ts" : "page/assets-folder.ts") } },
    oxc: { jsx: { runtime: "automatic", importSource: "preact" } },
    server: { fs: { allow: [".."] } },
    worker: { format: single ? "iife" : "es" },
    build: {
      outDir: single ? "dist-single" : "dist",
      target: "es2022",
      modulePreload: { polyfill: false },
      assetsInlineLimit: single ? Number.MAX_SAFE_INTEGER : 0,
      cssCodeSplit: !single,
      chunkSizeWarningLimit: 16_384,
      rolldownOptions: { output: single ? { codeSplitting: false } : {} },
    },
  };
});
