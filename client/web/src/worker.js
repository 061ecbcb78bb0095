// Decodes tiles beside the page, which meanwhile draws and answers.
import { prepare } from "./prepare.js";
import { decodeTile } from "./tile.js";

onmessage = ({ data: { id, bytes } }) => {
  try {
    const tile = prepare(decodeTile(bytes));
    postMessage({ id, tile }, [tile.flat.rows.buffer, tile.walls.rows.buffer]);
  } catch (error) {
    postMessage({ id, error: error.message });
  }
};
