// Builds the page: dist/ for a web server, dist/abbe.html as one file that opens from a disk.
//
// Steps: the module (cargo), its JavaScript side (bindgen/), its size (wasm-opt), the page (vite), the policy.
// `--page` repeats only the last two. `--quick`, for tests: without optimisation of the whole and without wasm-opt, a
// larger module in less time.

import { execFileSync } from "node:child_process";
import { createHash } from "node:crypto";
import { existsSync, mkdirSync, readdirSync, readFileSync, rmSync, statSync, writeFileSync } from "node:fs";
import { dirname, join, relative, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";

const here = dirname(fileURLToPath(import.meta.url));
const root = resolve(here, "..");
const target = resolve(process.env.CARGO_TARGET_DIR ?? join(root, "target"));
const triple = "wasm32-unknown-unknown";
const quick = process.argv.includes("--quick");
const QUICK = ["lto=false", "codegen-units=16"].flatMap((one) => ["--config", `profile.web.${one}`]);
// Vector instructions, and a memory that workers share: the module imports it, at most 4 GiB.
const FLAGS = [
  "-C target-feature=+simd128,+atomics,+bulk-memory,+mutable-globals",
  ...["shared-memory", "import-memory", `max-memory=${2 ** 32}`].map((option) => `-C link-arg=--${option}`),
  ...["__wasm_init_tls", "__tls_size", "__tls_align", "__tls_base"].map((name) => `-C link-arg=--export=${name}`),
].join(" ");
const LIBRARY = ["-Z", "build-std=std,panic_abort", "-Z", "build-std-features=optimize_for_size"];

function run(program, args, options = {}) {
  console.error(`== ${program} ${args.join(" ")}`);
  execFileSync(program, args, { cwd: here, stdio: "inherit", ...options });
}

function quiet(program, args) {
  try {
    return execFileSync(program, args, { stdio: ["ignore", "pipe", "ignore"] }).toString();
  } catch {
    return "";
  }
}

/**
 * The compilers with the source of the standard library: of rustup (component rust-src) or of Debian (rust-web-src). The
 * compiled library of rustup has no threads, and is built for speed: 0.36 MB of the module.
 */
function toolchain() {
  for (const rustc of ["rustc", "/usr/bin/rustc"]) {
    const sysroot = quiet(rustc, ["--print", "sysroot"]).trim();
    if (!sysroot || !existsSync(join(sysroot, "lib/rustlib/src/rust/library"))) continue;
    // That of rustup brings its linker.
    const linker = sysroot === "/usr" && readdirSync("/usr/bin").find((name) => /^wasm-ld(-\d+)?$/.test(name));
    const cargo = rustc.replace("rustc", "cargo");
    return { rustc, cargo, linker: linker ? ["--config", `target.${triple}.linker="/usr/bin/${linker}"`] : [] };
  }
  return undefined;
}

function buildModule() {
  const tools = toolchain();
  if (!tools) {
    console.error(
      "no source of the standard library: rustup component add rust-src, or apt-get install rustc-web cargo-web rust-web-src lld",
    );
    process.exit(3);
  }
  const args = ["--profile", "web", "--target", triple, "-p", "abbe-web", ...(quick ? QUICK : []), ...LIBRARY];
  run(tools.cargo, ["build", "--locked", ...args, ...tools.linker], {
    env: {
      ...process.env,
      CARGO_TARGET_DIR: target,
      CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS: FLAGS,
      RUSTC: tools.rustc,
      // Only a bootstrap builds the library from its source.
      RUSTC_BOOTSTRAP: "1",
    },
  });
  const bindgen = join(target, "bindgen");
  run(
    "cargo",
    [
      "run",
      "--locked",
      "--quiet",
      "--manifest-path",
      "bindgen/Cargo.toml",
      "--",
      join(target, triple, "web/abbe_web.wasm"),
      "pkg",
    ],
    {
      env: { ...process.env, CARGO_TARGET_DIR: bindgen },
    },
  );
  if (quick) return;
  const features = [
    "simd",
    "threads",
    "bulk-memory",
    "nontrapping-float-to-int",
    "sign-ext",
    "mutable-globals",
    "reference-types",
    "multivalue",
  ];
  const enabled = features.map((feature) => `--enable-${feature}`);
  run(process.execPath, [
    "node_modules/binaryen/bin/wasm-opt",
    "pkg/abbe_bg.wasm",
    "-Oz",
    ...enabled,
    "--strip-debug",
    "--strip-producers",
    "-o",
    "pkg/abbe_bg.wasm",
  ]);
}

const sha256 = (text) => `'sha256-${createHash("sha256").update(text).digest("base64")}'`;

/** The policy of the page. The script of reports runs in a frame without rights, which inherits the policy. */
function policy(scripts) {
  const report = sha256(readFileSync(join(root, "src/printers/page.js"), "utf8"));
  const single = scripts.length > 0;
  const own = single ? "" : "'self' ";
  return [
    "default-src 'none'",
    `script-src ${own}'wasm-unsafe-eval' ${[...scripts, report].join(" ")}${single ? " blob:" : ""}`,
    `style-src ${own}'unsafe-inline'`,
    "img-src data: blob:",
    ...(single ? [] : ["connect-src 'self'"]),
    `worker-src ${single ? "blob:" : "'self'"}`,
    "base-uri 'none'",
    "form-action 'none'",
  ].join("; ");
}

function files(folder) {
  return readdirSync(folder, { recursive: true })
    .map((name) => join(folder, name))
    .filter((name) => statSync(name).isFile());
}

function buildPage() {
  for (const mode of ["production", "single"]) {
    run(process.execPath, ["node_modules/vite/bin/vite.js", "build", "--mode", mode, "--logLevel", "warn"]);
  }
  const page = readFileSync(join(here, "dist/index.html"), "utf8");
  writeFileSync(join(here, "dist/index.html"), page.replace("POLICY", policy([])));
  writeFileSync(join(here, "dist/abbe.html"), singlePage());
  rmSync(join(here, "dist-single"), { recursive: true });
  writeFileSync(join(here, "dist/service-worker.js"), serviceWorker());
  // GitHub Pages leaves files as they are.
  writeFileSync(join(here, "dist/.nojekyll"), "");
}

/** The page with its script and its style in it. */
function singlePage() {
  const folder = join(here, "dist-single");
  let page = readFileSync(join(folder, "index.html"), "utf8");
  let script = "";
  page = page.replace(/\s*<script type="module"[^>]*src="([^"]+)"[^>]*><\/script>/, (_, file) => {
    script = readFileSync(join(folder, file), "utf8").replaceAll("</script", "<\\/script").replaceAll("<!--", "<\\!--");
    return "";
  });
  page = page.replace(/\s*<link rel="stylesheet"[^>]*href="([^"]+)"[^>]*>/, (_, file) => {
    return `<style>${readFileSync(join(folder, file), "utf8")}</style>`;
  });
  if (!script) throw new Error("the page has no script");
  // Functions as replacements: the script contains `$&`.
  page = page.replace("</body>", () => `<script type="module">${script}</script></body>`);
  return page.replace("POLICY", () => policy([sha256(script)]));
}

/** Keeps the files of the page, under a name that changes with them. */
function serviceWorker() {
  const folder = join(here, "dist");
  const own = files(folder)
    .map((file) => relative(folder, file))
    .filter((file) => !/abbe\.html$|service-worker\.js$/.test(file))
    .sort();
  const version = createHash("sha256");
  for (const file of own) version.update(file).update(readFileSync(join(folder, file)));
  const name = JSON.stringify(`abbe-${version.digest("hex").slice(0, 16)}`);
  return `const NAME = ${name};
const FILES = ${JSON.stringify(["./", ...own])};
addEventListener("install", (event) => {
  // From the server: the cache of the browser may still hold files of the version before.
  const fresh = FILES.map((file) => new Request(file, { cache: "reload" }));
  const kept = caches.open(NAME).then((cache) => cache.addAll(fresh));
  event.waitUntil(kept.then(() => skipWaiting()));
});
addEventListener("activate", (event) => {
  const isOld = (name) => name.startsWith("abbe-") && name !== NAME;
  const removed = caches.keys().then((names) => Promise.all(names.filter(isOld).map((name) => caches.delete(name))));
  event.waitUntil(removed.then(() => clients.claim()));
});
// With these headers the browser isolates the page, and workers may share a memory.
function isolated(answer) {
  if (answer.status === 0) return answer;
  const headers = new Headers(answer.headers);
  headers.set("Cross-Origin-Opener-Policy", "same-origin");
  headers.set("Cross-Origin-Embedder-Policy", "require-corp");
  return new Response(answer.body, { status: answer.status, statusText: answer.statusText, headers });
}
addEventListener("fetch", (event) => {
  if (event.request.method !== "GET") return;
  const kept = caches.match(event.request, { ignoreSearch: true });
  event.respondWith(kept.then((kept) => kept ?? fetch(event.request)).then(isolated));
});
`;
}

mkdirSync(join(here, "pkg"), { recursive: true });
if (!process.argv.includes("--page")) buildModule();
buildPage();
const size = (file) => `${file}: ${(statSync(join(here, file)).size / 1e6).toFixed(2)} MB`;
const module = readFileSync(join(here, "pkg/abbe_bg.wasm"));
console.error(
  `${size("pkg/abbe_bg.wasm")}, ${(gzipSync(module, { level: 9 }).length / 1e6).toFixed(2)} MB compressed; ${size("dist/abbe.html")}`,
);
