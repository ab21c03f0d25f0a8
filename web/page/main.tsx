// The page: three views and what they share.

import { render } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import { keepOffline } from "#assets";
import { Analyse } from "./analyse";
import { Explore, type KeptPlan } from "./explore";
import { FaultBox } from "./fault";
import type { FileMap } from "./files";
import { type Importable, Wizard } from "./import";
import { fromFragment, type Shared, toFragment } from "./share";
import { Store } from "./store";
import { Tabs } from "./tabs";
import { askBeforeLeaving, KeepingProvider, keptValue, useKeeping } from "./work";
import "./style.css";

const VIEWS = ["Analyse", "Explore", "Import"] as const;
type View = (typeof VIEWS)[number];

/** A session that a view hands to another: its files and the path of the session file. */
export interface Opened {
  files: FileMap;
  session: string;
  /** The files from which these were made, if they are others. */
  base?: FileMap;
}

/** The plan that a fragment holds, or that it should hold one and does not. */
function sharedBy(fragment: string): { plan?: Shared; isBroken: boolean } {
  const plan = fromFragment(fragment);
  return { plan, isBroken: plan === undefined && fragment.startsWith("#plan=") };
}

function App() {
  const keeping = useKeeping();
  const [address, setAddress] = useState(() => firstAddress(keptValue(keeping, "plan")));
  const shared = address.plan;
  const [view, setView] = useState<View>(() => firstView(keptValue(keeping, "view"), shared));
  useEffect(() => keeping.store.keep("view", view), [view]);
  // Another address in the same tab loads nothing.
  useEffect(() => {
    const changed = () => {
      const next = sharedBy(location.hash);
      setAddress(next);
      if (next.plan) setView("Explore");
    };
    addEventListener("hashchange", changed);
    return () => removeEventListener("hashchange", changed);
  }, []);
  // What each view was given. A view keeps its work until it is given something else.
  const [opened, setOpened] = useState<{ Analyse?: Opened; Explore?: Opened; Import?: Importable }>({});
  const explored = useRef(false);
  explored.current ||= view === "Explore";
  const look = (to: View) => {
    setView(to);
    setAddress((before) => ({ ...before, isBroken: false }));
  };
  const show =
    <To extends View>(to: To) =>
    (next: To extends "Import" ? Importable : Opened) => {
      setOpened((all) => ({ ...all, [to]: next }));
      setView(to);
    };
  return (
    <>
      <header>
        <h1>Abbe</h1>
        <Tabs label="Views" names={VIEWS} shown={view} show={look} />
        <p class="note">Geometric errors of machine tools. The data stay in this page.</p>
      </header>
      <main>
        {address.isBroken && (
          <FaultBox
            fault={{ message: "the address holds no plan that can be read; perhaps a part of it is missing" }}
          />
        )}
        <section id="Analyse" role="tabpanel" hidden={view !== "Analyse"} aria-label="Analyse">
          <Analyse opened={opened.Analyse} explore={show("Explore")} imports={show("Import")} />
        </section>
        <section id="Explore" role="tabpanel" hidden={view !== "Explore"} aria-label="Explore">
          {explored.current && <Explore opened={opened.Explore} shared={shared} analyse={show("Analyse")} />}
        </section>
        <section id="Import" role="tabpanel" hidden={view !== "Import"} aria-label="Import">
          <Wizard opened={opened.Import} analyse={show("Analyse")} />
        </section>
      </main>
    </>
  );
}

/** What the address holds besides what this page keeps: after a reload that is the same plan. */
function firstAddress(kept: KeptPlan | undefined): { plan?: Shared; isBroken: boolean } {
  const found = sharedBy(location.hash);
  const isKept = kept !== undefined && toFragment(kept.timeline.present) === location.hash;
  return isKept ? { isBroken: false } : found;
}

/** The view of before the page was loaded; a plan in the address is shown. */
function firstView(kept: string | undefined, shared: Shared | undefined): View {
  return shared ? "Explore" : (VIEWS.find((view) => view === kept) ?? "Analyse");
}

// A file that misses the field for it does not take the place of the page.
for (const name of ["dragover", "drop"]) addEventListener(name, (event) => event.preventDefault());
askBeforeLeaving();
const root = document.getElementById("app");
void Store.open().then((keeping) => {
  const app = (
    <KeepingProvider value={keeping}>
      <App />
    </KeepingProvider>
  );
  if (root) render(app, root);
});
keepOffline();
