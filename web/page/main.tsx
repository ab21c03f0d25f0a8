// The page: three views and what they share.

import { render } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import { keepOffline } from "#assets";
import { Analyse } from "./analyse";
import { Explore } from "./explore";
import { FaultBox } from "./fault";
import type { FileMap } from "./files";
import { Wizard } from "./import";
import { fromFragment, type Shared } from "./share";
import "./style.css";

const VIEWS = ["Analyse", "Explore", "Import"] as const;
type View = (typeof VIEWS)[number];

/** A session that a view hands to another: its files and the path of the session file. */
export interface Opened {
  files: FileMap;
  session: string;
}

/** The plan that a fragment holds, or that it should hold one and does not. */
function sharedBy(fragment: string): { plan?: Shared; isBroken: boolean } {
  const plan = fromFragment(fragment);
  return { plan, isBroken: plan === undefined && fragment.startsWith("#plan=") };
}

function App() {
  const [address, setAddress] = useState(() => sharedBy(location.hash));
  const shared = address.plan;
  const [view, setView] = useState<View>(shared ? "Explore" : "Analyse");
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
  const [opened, setOpened] = useState<Partial<Record<View, Opened>>>({});
  const explored = useRef(false);
  explored.current ||= view === "Explore";
  const look = (to: View) => {
    setView(to);
    setAddress((before) => ({ ...before, isBroken: false }));
  };
  const show = (to: View) => (next: Opened) => {
    setOpened((all) => ({ ...all, [to]: next }));
    setView(to);
  };
  return (
    <>
      <header>
        <h1>Abbe</h1>
        <nav role="tablist" aria-label="Views">
          {VIEWS.map((name) => (
            <button key={name} role="tab" aria-selected={view === name} onClick={() => look(name)}>
              {name}
            </button>
          ))}
        </nav>
        <p class="note">Geometric errors of machine tools. The data stay in this page.</p>
      </header>
      <main>
        {address.isBroken && (
          <FaultBox
            fault={{ message: "the address holds no plan that can be read; perhaps a part of it is missing" }}
          />
        )}
        <section hidden={view !== "Analyse"} aria-label="Analyse">
          <Analyse opened={opened.Analyse} explore={show("Explore")} imports={show("Import")} />
        </section>
        <section hidden={view !== "Explore"} aria-label="Explore">
          {explored.current && <Explore opened={opened.Explore} shared={shared} analyse={show("Analyse")} />}
        </section>
        <section hidden={view !== "Import"} aria-label="Import">
          <Wizard opened={opened.Import} analyse={show("Analyse")} />
        </section>
      </main>
    </>
  );
}

// A file that misses the field for it does not take the place of the page.
for (const name of ["dragover", "drop"]) addEventListener(name, (event) => event.preventDefault());
const root = document.getElementById("app");
if (root) render(<App />, root);
keepOffline();
