// Tiles decoded by a worker, in the order they are asked for.
export class Decoder {
  constructor() {
    this.waiting = new Map();
    this.next = 0;
    this.worker = new Worker("/worker.js");
    this.worker.onmessage = ({ data: { id, tile, error } }) => {
      const { done, fail } = this.waiting.get(id);
      this.waiting.delete(id);
      if (error) fail(new Error(error));
      else done(tile);
    };
    this.worker.onerror = (event) => {
      for (const { fail } of this.waiting.values()) fail(new Error(event.message || "the viewer's worker does not run"));
      this.waiting.clear();
    };
  }
  // `bytes` go to the worker. Throws an Error for what is no tile.
  decode(bytes) {
    return new Promise((done, fail) => {
      const id = ++this.next;
      this.waiting.set(id, { done, fail });
      this.worker.postMessage({ id, bytes }, [bytes.buffer]);
    });
  }
}
