// The page: three views and what they share.

import { render } from "preact";
import { useRef, useState } from "preact/hooks";
import { keepOffline } from "#assets";
import { Analyse } from "./analyse";
import { Explore } from "./explore";
import type { FileMap } from "./files";
import { Wizard } from "./import";
import { fromFragment } from "./share";
import "./style.css";

const VIEWS = ["Analyse", "Explore", "Import"] as const;
type View = (typeof VIEWS)[number];

/** A session that a view hands to another: its files and the path of the session file. */
export interface Opened {
  files: FileMap;
  session: string;
}

function App() {
  const [shared] = useState(() => fromFragment(location.hash));
  const [view, setView] = useState<View>(shared ? "Explore" : "Analyse");
  // What each view was given. A view keeps its work until it is given something else.
  const [opened, setOpened] = useState<Partial<Record<View, Opened>>>({});
  const explored = useRef(false);
  explored.current ||= view === "Explore";
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
            <button key={name} role="tab" aria-selected={view === name} onClick={() => setView(name)}>
              {name}
            </button>
          ))}
        </nav>
        <p class="note">Geometric errors of machine tools. The data stay in this page.</p>
      </header>
      <main>
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

const root = document.getElementById("app");
if (root) render(<App />, root);
keepOffline();
