// Writes the records of a LAZ file's points as npm's laz-perf unpacks them.
//   node laz_perf_records.cjs NODE_MODULES FILE.laz OUT
const fs = require("node:fs");
const path = require("node:path");

async function main([modules, file, out]) {
  const { createLazPerf } = require(path.resolve(modules, "laz-perf"));
  const lib = await createLazPerf();
  const bytes = fs.readFileSync(file);
  const at = lib._malloc(bytes.length);
  lib.HEAPU8.set(bytes, at);
  const laz = new lib.LASZip();
  laz.open(at, bytes.length);
  const size = laz.getPointLength();
  const point = lib._malloc(size);
  const records = Buffer.alloc(laz.getCount() * size);
  for (let i = 0; i < laz.getCount(); ++i) {
    laz.getPoint(point);
    records.set(lib.HEAPU8.subarray(point, point + size), i * size);
  }
  fs.writeFileSync(out, records);
}

main(process.argv.slice(2)).catch((error) => {
  console.error(error);
  process.exit(1);
});
