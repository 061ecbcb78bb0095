// Calls of the contract as Connect has them, in JSON.
const TOKEN = "strata-token";

export class CallError extends Error {
  constructor(error, status) {
    super(error.message || `the server answered ${status}`);
    this.code = error.code ?? "unknown";
  }
}

export function setToken(token) {
  if (token) sessionStorage.setItem(TOKEN, token);
  else sessionStorage.removeItem(TOKEN);
}

function headersOf(type) {
  const headers = { "connect-protocol-version": "1" };
  if (type) headers["content-type"] = type;
  const token = sessionStorage.getItem(TOKEN);
  if (token) headers.authorization = `Bearer ${token}`;
  return headers;
}

// What a call failed with. That the server wants a token, or another, concerns the whole page.
function failure(error, status) {
  const failed = new CallError(error, status);
  if (failed.code === "unauthenticated" || status === 401) dispatchEvent(new CustomEvent("unauthenticated"));
  return failed;
}

async function errorOf(response) {
  const text = await response.text();
  let error = { message: text };
  try {
    error = JSON.parse(text);
  } catch {
    // Not a call's answer.
  }
  return failure(error, response.status);
}

// `method` as in "Maps/List".
export async function call(method, request, signal) {
  const response = await fetch(`/strata.v1.${method}`, {
    method: "POST",
    headers: headersOf("application/json"),
    body: JSON.stringify(request),
    signal,
  });
  if (!response.ok) throw await errorOf(response);
  return response.json();
}

function envelope(text) {
  const bytes = new TextEncoder().encode(text);
  const result = new Uint8Array(5 + bytes.length);
  new DataView(result.buffer).setUint32(1, bytes.length);
  result.set(bytes, 5);
  return result;
}

// The envelopes of a body, as [flags, text].
async function* envelopes(body) {
  const reader = body.getReader();
  let held = new Uint8Array();
  for (;;) {
    while (held.length >= 5) {
      const size = new DataView(held.buffer, held.byteOffset).getUint32(1);
      if (held.length < 5 + size) break;
      yield [held[0], new TextDecoder().decode(held.subarray(5, 5 + size))];
      held = held.subarray(5 + size);
    }
    const { done, value } = await reader.read();
    if (done) return;
    const joined = new Uint8Array(held.length + value.length);
    joined.set(held);
    joined.set(value, held.length);
    held = joined;
  }
}

// The messages of a stream of answers.
export async function* stream(method, request, signal) {
  const response = await fetch(`/strata.v1.${method}`, {
    method: "POST",
    headers: headersOf("application/connect+json"),
    body: envelope(JSON.stringify(request)),
    signal,
  });
  if (!response.ok) throw await errorOf(response);
  for await (const [flags, text] of envelopes(response.body)) {
    const message = JSON.parse(text);
    if (!(flags & 2)) yield message;
    else if (message.error) throw failure(message.error, response.status);
    else return;
  }
  throw new CallError({ code: "unavailable", message: "the connection broke off" }, 0);
}

// Bytes of a tile; `created` keeps tiles of another map of that name out of the browser's cache.
export async function tileBytes(map, created, { level = 0, x = 0, y = 0 }, version) {
  const path = `/v1/maps/${encodeURIComponent(map)}/tiles/${level}/${x}/${y}`;
  const response = await fetch(`${path}?v=${version}&of=${encodeURIComponent(created ?? "")}`, {
    headers: headersOf(),
  });
  if (!response.ok) throw await errorOf(response);
  return new Uint8Array(await response.arrayBuffer());
}
