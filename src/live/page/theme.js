// The theme of the page and of the viewer: light, dark, or the system's.

const THEMES = ["system", "light", "dark"];
const SCHEME = /^\(prefers-color-scheme: (light|dark)\)$/;
const button = document.getElementById("theme");
const system = window.matchMedia("(prefers-color-scheme: dark)");
let name = localStorage.getItem("theme");
if (!THEMES.includes(name)) name = "system";

const isDark = () => (name === "system" ? system.matches : name === "dark");

// The viewer follows the browser's colour scheme, and asks again after each change: here it finds the page's theme in its place.
const scheme = new EventTarget();
const plain = window.matchMedia.bind(window);
window.matchMedia = (query) => {
  const [, asked] = SCHEME.exec(query) ?? [];
  if (!asked) return plain(query);
  return {
    matches: isDark() === (asked === "dark"),
    addEventListener: (...listener) => scheme.addEventListener(...listener),
    removeEventListener: (...listener) => scheme.removeEventListener(...listener),
  };
};

function apply() {
  document.documentElement.dataset.theme = name;
  button.textContent = `Theme: ${name}`;
  scheme.dispatchEvent(new Event("change"));
}

button.addEventListener("click", () => {
  name = THEMES[(THEMES.indexOf(name) + 1) % THEMES.length];
  localStorage.setItem("theme", name);
  apply();
});
system.addEventListener("change", apply);
apply();
