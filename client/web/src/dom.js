// Pieces of the page, and how numbers are written there.
export const el = (id) => document.getElementById(id);

export function say(text) {
  el("message").textContent = text;
}

// JSON leaves out what is 0, and nobody wants to read -0.00.
export const metres = (value) => ((Math.round((value ?? 0) * 100) || 0) / 100).toFixed(2);

export function ageOf(created) {
  const days = (Date.now() - Date.parse(created)) / 86_400_000;
  return days < 1 / 24 ? `${Math.max(1, Math.round(days * 1440))} min` : days < 1 ? `${Math.round(days * 24)} h` : `${Math.round(days)} d`;
}

// As people say it: three digits and a decimal unit.
export function sizeOf(bytes) {
  const units = ["B", "kB", "MB", "GB", "TB"];
  const unit = units.findIndex((_, i) => bytes < 999.5 * 1000 ** i || i + 1 === units.length);
  const size = bytes / 1000 ** unit;
  return `${size.toFixed(unit && size < 99.95 ? 1 : 0)} ${units[unit]}`;
}

// In UTC; empty where it is of no calendar: files without times have 0, and some clocks begin with the robot.
export function dateOf(time) {
  return new Date(time ?? "") >= Date.UTC(1971) ? new Date(time).toISOString().replace("T", " ").slice(0, 19) : "";
}

// A button that tells what goes wrong. `label`: for those who do not see what is around it.
export function button(text, label, act) {
  const made = document.createElement("button");
  made.type = "button";
  made.textContent = text;
  made.setAttribute("aria-label", label);
  made.onclick = async () => {
    try {
      await act();
    } catch (error) {
      say(error.message);
    }
  };
  return made;
}

// `tag` with text, or with nodes.
export function node(tag, ...inside) {
  const made = document.createElement(tag);
  made.append(...inside);
  return made;
}
