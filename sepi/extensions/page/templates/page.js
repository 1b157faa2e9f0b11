"use strict";

/* The page: its theme, and the scene that is looked at. */

Sepi.theme = () => {
  const button = Sepi.byId("theme");
  const dark = () => document.documentElement.dataset.theme === "dark" ||
    (!document.documentElement.dataset.theme && matchMedia("(prefers-color-scheme: dark)").matches);
  const name = () => (button.textContent = dark() ? "light" : "dark");
  button.addEventListener("click", () => {
    document.documentElement.dataset.theme = dark() ? "light" : "dark";
    name();
  });
  name();
};

Sepi.start = () => {
  Sepi.theme();
  const root = Sepi.byId("viewer");
  if (!root) return;
  if (!("DecompressionStream" in window)) {
    root.prepend(Sepi.element("p", {}, "The maps need a browser of 2023 or later (DecompressionStream)."));
    return;
  }
  const pixels = Sepi.byId("pixel") ? new Sepi.Pixels(Sepi.byId("pixel")) : null;
  const cloud = new Sepi.Cloud(Sepi.byId("cloud"));
  const viewer = new Sepi.Viewer(root, (x, y) => pixels?.nearest(x, y));
  if (pixels) pixels.selected = (number) => viewer.markChosen(number);
  Sepi.viewer = viewer;
  const select = Sepi.byId("scene");
  const show = async () => {
    const scene = Sepi.json(select.value);
    pixels?.show(scene);
    const shown = viewer.show(scene);
    if (pixels) viewer.markChosen(pixels.number);
    await shown;
    cloud.show(viewer.panels);
    root.dataset.scene = select.value;
  };
  for (const [id, step] of [["previous", -1], ["next", 1]]) {
    Sepi.byId(id)?.addEventListener("click", () => {
      const count = select.options.length;
      select.selectedIndex = (select.selectedIndex + step + count) % count;
      show();
    });
  }
  select.addEventListener("change", show);
  show();
};

Sepi.start();
