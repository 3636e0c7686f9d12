"use strict";
/* Break: faults of doubles, a stall and the death of the run, and the test that they make. */

async function breaking(section) {
  let offered;
  try { offered = await ask("breaks"); } catch (error) {
    if (model.is_live) section.append(element("h2", {}, "Break"), element("p", { class: "quiet" }, error.message));
    return;
  }
  const device = element("select", { "aria-label": "device" }, offered.devices.map((each) => element("option", { value: each.name }, each.name)));
  const span = element("select", { "aria-label": "for how long" }, [["1", "for 1 s"], ["0.2", "for 0.2 s"], ["5", "for 5 s"], ["", "until ended"]].map(([value, words]) => element("option", { value }, words)));
  const buttons = element("p", { class: "acts" });
  const struck = element("ol", { class: "quiet struck" });
  const refresh = async () => {
    const now = await ask("breaks");
    struck.replaceChildren(...now.struck.map((each) => element("li", {}, `${numberText(each.at_s, 6)} s: ${each.kind} ${each.device ?? ""}${each.for_s === null || each.for_s === undefined ? "" : ` for ${each.for_s} s`}`)));
  };
  const save = async () => {
    try { await download("break-test", "test_found.py"); } catch (error) { say(`save as a test: ${error.message}`); }
  };
  const strike = async (kind) => {
    try {
      await ask("break", { kind, device: device.value, for_s: span.value === "" ? null : Number(span.value) });
      await refresh();
    } catch (error) { say(`${kind}: ${error.message}`); }
  };
  const offer = () => {
    const kinds = offered.devices.find((each) => each.name === device.value)?.kinds ?? [];
    buttons.replaceChildren(...kinds.map((kind) => element("button", { type: "button", title: offered.kinds[kind] ?? "", onclick: () => strike(kind) }, kind)));
  };
  device.addEventListener("change", offer);
  section.append(element("h2", {}, "Break"), element("p", {}, device, " ", span), buttons,
    element("p", { class: "acts" }, act("Stall the loop", "stall", () => ({ for_s: 0.3 })), act("Kill the run", "kill", undefined, { css: "danger" }),
      act("End all faults", "clear"), element("button", { type: "button", onclick: save }, "Save as a test")),
    struck);
  offer();
  await refresh();
}
