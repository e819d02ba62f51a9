// Light or dark: what the system prefers, unless the reader chose; printed always light. `themechange` tells drawings of it.
(() => {
  const root = document.documentElement, system = matchMedia("(prefers-color-scheme: dark)");
  const isDark = () => (root.dataset.theme || (system.matches ? "dark" : "light")) === "dark";
  function apply(theme) {
    if (theme) root.dataset.theme = theme;
    else delete root.dataset.theme;
    const button = document.getElementById("theme");
    if (button) button.textContent = isDark() ? "Light mode" : "Dark mode";
    document.dispatchEvent(new Event("themechange"));
  }
  let chosen = null;
  try { chosen = localStorage.getItem("kr5-theme"); } catch { /* a page may have no storage */ }
  apply(chosen);
  function toggle() {
    chosen = isDark() ? "light" : "dark";
    try { localStorage.setItem("kr5-theme", chosen); } catch { /* then it lasts as long as the page */ }
    apply(chosen);
  }
  system.addEventListener("change", () => apply(chosen));
  addEventListener("beforeprint", () => apply("light"));
  addEventListener("afterprint", () => apply(chosen));
  document.addEventListener("DOMContentLoaded", () => {
    const button = document.getElementById("theme");
    button.hidden = false;
    button.addEventListener("click", toggle);
    apply(chosen);
  });
})();
