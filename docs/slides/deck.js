// A deck: keys, clicks and swipes, the number of the slide behind the #, and text made smaller until it fits.
(() => {
  "use strict";
  const slides = [...document.querySelectorAll(".slide")], nav = document.querySelector("nav");
  let at = 0;
  document.body.classList.add("deck");
  document.body.dataset.theme = localStorage.getItem("theme") || "auto"; // as the pages of the site

  function show(n) {
    at = Math.min(slides.length - 1, Math.max(0, n));
    slides.forEach((slide, i) => { slide.classList.toggle("now", i === at); slide.inert = i !== at && getComputedStyle(slide).position === "absolute"; });
    nav.querySelector("output").textContent = `${at + 1}/${slides.length}`;
  }
  const single = () => getComputedStyle(slides[0]).position === "absolute"; // on a phone they are one below the other
  function go(n) {
    show(n);
    history.replaceState(null, "", `#${at + 1}`);
    if (!single()) slides[at].scrollIntoView();
  }

  // The text of each slide, larger where it would leave much of the slide empty, and smaller where it would leave it.
  function fit() {
    const least = parseFloat(getComputedStyle(document.querySelector("footer")).fontSize);
    for (const slide of slides) {
      const inner = slide.firstElementChild;
      inner.style.fontSize = "";
      const most = slide.querySelector(":scope > div > figure") ? 1 : 1.4; // letters fill what text leaves empty
      for (let size = most; single() && size >= 0.72; size -= 0.04) {
        inner.style.fontSize = `${size}em`;
        if (inner.scrollHeight <= slide.clientHeight - 2 * inner.offsetTop && inner.scrollWidth <= inner.clientWidth) break;
      }
    }
    for (const map of document.querySelectorAll("svg.map")) {
      const before = map.style.zoom;
      map.style.zoom = single() ? least / 10 : 1; // 10: its smallest letters
      if (map.style.zoom !== before) map.closest("figure").dispatchEvent(new Event("zoomed"));
    }
  }

  // A number, or the state of a widget, which is on some slide.
  function place() {
    const widget = location.hash.match(/^#(\w+)\./), n = Number(location.hash.slice(1));
    const found = widget ? slides.findIndex((slide) => slide.querySelector(`[data-widget="${widget[1]}"]`)) : n - 1;
    show(found > 0 ? found : 0);
  }

  const used = (event) => event.target.closest("a, button, input, label, summary, figure.widget");
  document.addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowDown: 1, PageDown: 1, " ": 1, ArrowLeft: -1, ArrowUp: -1, PageUp: -1, Home: -1e9, End: 1e9 }[event.key];
    const paging = event.key.startsWith("Page");
    if (step === undefined || event.ctrlKey || event.altKey || event.metaKey || (used(event) && !paging && event.target.closest("input, .slide"))) return;
    if (event.key === " " && used(event)) return;
    event.preventDefault();
    go(at + (event.key === " " && event.shiftKey ? -1 : step));
  });
  document.querySelector("main").addEventListener("click", (event) => {
    if (!used(event) && single() && !String(getSelection())) go(at + (event.clientX < innerWidth / 4 ? -1 : 1));
  });
  let from = null;
  document.addEventListener("touchstart", (event) => { from = used(event) ? null : event.changedTouches[0]; }, { passive: true });
  document.addEventListener("touchend", (event) => {
    if (!from) return;
    const dx = event.changedTouches[0].clientX - from.clientX, dy = event.changedTouches[0].clientY - from.clientY;
    if (Math.abs(dx) > 50 && Math.abs(dx) > 2 * Math.abs(dy)) go(at + (dx < 0 ? 1 : -1));
  }, { passive: true });
  nav.querySelector("[name=back]").addEventListener("click", () => go(at - 1));
  nav.querySelector("[name=on]").addEventListener("click", () => go(at + 1));
  window.addEventListener("hashchange", place);
  window.addEventListener("resize", () => { fit(); show(at); });
  document.addEventListener("click", (event) => { if (event.target.closest("figure.widget")) fit(); });
  window.addEventListener("load", async () => {
    await (window.MathJax && MathJax.startup ? MathJax.startup.promise : null);
    fit();
    place();
    document.body.dataset.ready = "yes";
  });
})();
