// Makes of src/ what stratad --web-viewer serves: node build.mjs [FOLDER].
import { build } from "esbuild";
import { cp, mkdir, readFile, writeFile } from "node:fs/promises";
import path from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";

const here = path.dirname(fileURLToPath(import.meta.url));
const out = path.resolve(process.argv[2] ?? path.join(here, "dist"));
await mkdir(out, { recursive: true });
await build({
  entryPoints: { viewer: path.join(here, "src/main.js"), worker: path.join(here, "src/worker.js") },
  outdir: out,
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2022",
  legalComments: "eof",
});
for (const file of ["index.html", "viewer.css", "icon.svg"]) await cp(path.join(here, "src", file), path.join(out, file));
// Packed beside each, for browsers that take it so; icon.svg is too small for it.
for (const file of ["index.html", "viewer.css", "viewer.js", "worker.js"]) {
  await writeFile(path.join(out, `${file}.gz`), gzipSync(await readFile(path.join(out, file)), { level: 9 }));
}
