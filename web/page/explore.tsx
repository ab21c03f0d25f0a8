// Explore: a plan that changes while it is looked at. The texts of machine and plan are the state; everything else
// follows from them.

import { zipSync } from "fflate";
import { useEffect, useRef, useState } from "preact/hooks";
import { bundled, filesOf } from "./bundled";
import type { Curve } from "./chart";
import { Charts } from "./charts";
import { type Call, computedCurves } from "./curves";
import { Editor } from "./editor";
import { Engine, EngineError } from "./engine";
import { Equation } from "./equation";
import { FaultBox, faultOf } from "./fault";
import { beside, download, text } from "./files";
import { type Analysis, Identifiability } from "./identifiability";
import { useLatest } from "./latest";
import type { Opened } from "./main";
import { asPlan, machineFile, tests, withBall, withCopy, withoutTest, withPart, withValue } from "./plan-text";
import type { Fault } from "./protocol";
import type { SetUp } from "./scene";
import { SetUpView } from "./set-up";
import { type Shared, toFragment } from "./share";
import { Sliders } from "./sliders";
import { TestForm } from "./test-form";

export interface PlannedTest extends SetUp {
  name: string;
  bar_mm: number | null;
  moves: string[];
  readings: number;
  /** The names of the coordinates of a reading; one for a length. */
  coordinates: string[];
}

export interface Parameter {
  id: string;
  unit: string;
  setup: boolean;
}

/** A key of a file: what it is, and the type of its value. */
export interface Key {
  description?: string;
  type?: string | string[];
}

export interface Description {
  machine: string;
  chain: string;
  tests: PlannedTest[];
  parameters: Parameter[];
  warnings: string[];
  /** The keys of a test of this instrument, from the schema; those of its motion. */
  test_keys: Record<string, Key>;
  motion_keys: Record<string, Key>;
  abscissae: Float64Array[];
}

interface ProposedTest {
  test: string;
  after: number | null;
  duration_min: number;
  name: string;
  session_toml: string;
}

interface Improvement {
  criterion: string;
  before: number | null;
  steps: ProposedTest[];
}

interface Props {
  opened?: Opened;
  shared?: Shared;
  analyse: (opened: Opened) => void;
}

const TEMPLATES = [
  "hermle-c600u/chapter5.toml",
  "hermle-c600u/chapter4.toml",
  "hermle-c600u/chapter6.toml",
  "table-and-head/session.toml",
  "tilting-head/session.toml",
];

/** The texts of a session as a plan. */
function planOf({ files, session }: Opened): Shared {
  const own = text(files, session);
  const named = machineFile(own);
  const path = named === undefined ? undefined : beside(session, named);
  const machine = path !== undefined && files.has(path) ? text(files, path) : "";
  return { machine, plan: asPlan(own), values: {} };
}

function templateOf(path: string): Shared {
  return planOf({ files: filesOf(path), session: path.slice(path.lastIndexOf("/") + 1) });
}

export function Explore({ opened, shared, analyse }: Props) {
  const engine = useRef<Engine | undefined>(undefined);
  engine.current ??= new Engine();
  const thinker = useRef<Engine | undefined>(undefined);
  thinker.current ??= new Engine();
  const [state, setState] = useState<Shared>(() => (opened ? planOf(opened) : (shared ?? templateOf(TEMPLATES[0]))));
  const [description, setDescription] = useState<Description>();
  const [curves, setCurves] = useState<Curve[][][]>([]);
  const [kind, setKind] = useState<"patterns" | "sensitivities">("patterns");
  const [analysis, setAnalysis] = useState<Analysis>();
  const [latex, setLatex] = useState<string | Fault>("");
  const [proposal, setProposal] = useState<Improvement | string>();
  const [test, setTest] = useState(0);
  const [code, setCode] = useState("[wCAbYXZt]");
  const [fault, setFault] = useState<Fault>();
  const [isShareable, setIsShareable] = useState(true);
  /** The pictures of changes: how many there were, and how long the last took. */
  const [picture, setPicture] = useState({ number: 0, milliseconds: 0 });
  const wanted = useRef({ state, kind, test, since: 0, known: "", description: undefined as Description | undefined });
  Object.assign(wanted.current, { state, kind, test });

  // Curves follow at once. What takes longer has a worker of its own, so that no curve waits for it.
  const curvesNow = useLatest(async (isLatest) => {
    const job = wanted.current;
    const { state, kind } = job;
    const call = caller(engine.current);
    try {
      if (job.known !== textsOf(state)) {
        job.description = await call<Description>("plan", ["plan.toml"], { files: folderOf(state) });
        job.known = textsOf(state);
        setDescription(job.description);
        setFault(undefined);
      }
      const found = job.description;
      if (!found) return;
      const values = Float64Array.from(found.parameters, ({ id }) => state.values[id] ?? 0);
      const next = await computedCurves(found, values, kind, call);
      setCurves(next);
      if (isLatest()) analyseNow();
    } catch (error) {
      // The text with a fault is not known to the worker as a plan.
      job.known = "";
      job.since = 0;
      setFault(faultOf(error));
    }
  });
  const thought = useRef({ texts: "", test: -1 });
  const analyseNow = useLatest(async (isLatest) => {
    const { state, test } = wanted.current;
    const texts = textsOf(state);
    const call = caller(thinker.current);
    try {
      if (thought.current.texts !== texts) {
        await call("plan", ["plan.toml"], { files: folderOf(state) });
        setAnalysis(await call<Analysis>("analysis"));
        thought.current = { texts, test: -1 };
      }
      if (!isLatest() || thought.current.test === test) return;
      setLatex(await call<string>("equation", [test]).catch(faultOf));
      thought.current.test = test;
    } catch (error) {
      thought.current.texts = "";
      setFault(faultOf(error));
    }
  });
  useEffect(curvesNow, [state, kind, test]);
  useEffect(() => {
    const timer = setTimeout(() => {
      const fragment = toFragment(state);
      setIsShareable(fragment !== undefined);
      history.replaceState(null, "", fragment ?? "#");
    }, 300);
    return () => clearTimeout(timer);
  }, [state]);
  useEffect(
    () => () => {
      engine.current?.stop();
      thinker.current?.stop();
    },
    [],
  );

  const begin = () => {
    wanted.current.since ||= performance.now();
  };
  const drawn = () => {
    const { since } = wanted.current;
    if (!since) return;
    wanted.current.since = 0;
    // After the other charts, which are drawn in the same turn.
    queueMicrotask(() => {
      const milliseconds = performance.now() - since;
      setPicture(({ number }) => ({ number: number + 1, milliseconds }));
    });
  };
  const change = (next: Partial<Shared>) => {
    begin();
    wanted.current.state = { ...wanted.current.state, ...next };
    setState(wanted.current.state);
  };
  const changePlan = (edit: (plan: string) => string) => change({ plan: edit(wanted.current.state.plan) });
  const open = (next: Shared) => {
    setProposal(undefined);
    setTest(0);
    change(next);
  };
  const fromCode = async () => {
    try {
      const made = await engine.current?.call<Record<string, string>>("filesOfCode", [code]);
      if (made) open({ machine: made["machine.toml"], plan: made["plan.toml"], values: {} });
    } catch (error) {
      setFault(faultOf(error));
    }
  };
  const improve = async () => {
    setProposal("comparing candidate tests …");
    try {
      setProposal(await thinker.current?.call<Improvement>("improve"));
    } catch (error) {
      setProposal(error instanceof EngineError ? error.fault.message : String(error));
    }
  };
  const add = ({ name, session_toml }: ProposedTest) => {
    const free = JSON.stringify(description ? freeName(description, name) : name);
    changePlan((plan) => withValue(`${plan.trimEnd()}\n\n${session_toml}`, tests(plan), "name", free));
    setProposal(undefined);
  };
  const shown = useRef({ opened, shared });
  useEffect(() => {
    const before = shown.current;
    shown.current = { opened, shared };
    if (opened && opened !== before.opened) open(planOf(opened));
    else if (shared && shared !== before.shared) open(shared);
  }, [opened, shared]);
  const files = () => new Map(folderOf(state));
  const shownTest = description?.tests[Math.min(test, description.tests.length - 1)];
  const errors = description?.parameters ?? [];
  return (
    <>
      <p class="actions">
        <label>
          Template{" "}
          <select
            value=""
            onChange={(event) => event.currentTarget.value && open(templateOf(event.currentTarget.value))}
          >
            <option value="">choose …</option>
            {TEMPLATES.map((path) => (
              <option key={path} value={path}>
                {bundled.find(([known]) => known === path)?.[1] ?? path.replace(".toml", "")}
              </option>
            ))}
          </select>
        </label>
        <label>
          Structural code <input size={14} value={code} onInput={(event) => setCode(event.currentTarget.value)} />
        </label>
        <button onClick={() => void fromCode()}>Create</button>
        <button
          onClick={() => download("plan.zip", new Uint8Array(zipSync(Object.fromEntries(files()))), "application/zip")}
        >
          Save as a session folder
        </button>
        <button
          disabled={!isShareable}
          title={isShareable ? undefined : "the plan is too large for an address; save it as a folder"}
          onClick={() => void navigator.clipboard?.writeText(location.href)}
        >
          Copy the address
        </button>
        <button onClick={() => analyse({ files: files(), session: "plan.toml" })}>Open in Analyse</button>
      </p>
      {fault && <FaultBox fault={fault} />}
      {description && shownTest && (
        <div class="columns">
          <div>
            <p class="note">
              {description.machine}: {description.chain}
            </p>
            <TestForm
              tests={description.tests}
              keys={description.test_keys}
              motionKeys={description.motion_keys}
              test={test}
              plan={state.plan}
              select={setTest}
              set={(key, written) => changePlan((plan) => withValue(plan, test, key, written))}
              place={(ball, written) => changePlan((plan) => withBall(plan, test, ball, written))}
              setPart={(key, part, written, number) =>
                changePlan((plan) => withValue(plan, test, key, withPart(written, part, number)))
              }
              copy={() => changePlan((plan) => withCopy(plan, test, freeName(description, `${shownTest.name}-2`)))}
              remove={() => {
                changePlan((plan) => withoutTest(plan, test));
                setTest(0);
              }}
            />
            <Sliders parameters={errors} values={state.values} set={(values) => change({ values })} />
          </div>
          <div>
            <SetUpView
              setUp={shownTest}
              dragged={(ball, to) => changePlan((plan) => withBall(plan, test, ball, `[${to.join(", ")}]`))}
            />
            <p class="actions">
              <label>
                Show{" "}
                <select value={kind} onChange={(event) => setKind(event.currentTarget.value as typeof kind)}>
                  <option value="patterns">trace patterns: change of the readings</option>
                  <option value="sensitivities">sensitivities: change per unit of each error</option>
                </select>
              </label>
              <span class="note" data-ms={picture.milliseconds.toFixed(1)} data-pictures={picture.number}>
                {picture.number > 0 && `${picture.milliseconds.toFixed(0)} ms from change to picture`}
              </span>
            </p>
            <Charts description={description} curves={curves} kind={kind} drawn={drawn} />
            {analysis && <Identifiability analysis={analysis} />}
            <h2>Next test</h2>
            <p class="actions">
              <button onClick={() => void improve()}>Improve</button>
              {typeof proposal === "string" && <span role="status">{proposal}</span>}
            </p>
            {proposal && typeof proposal !== "string" && (
              <ul>
                {proposal.steps.map((step) => (
                  <li key={step.test}>
                    {step.test}, {step.duration_min.toFixed(1)} min: {proposal.criterion}{" "}
                    {proposal.before?.toPrecision(3) ?? "∞"} → {step.after?.toPrecision(3) ?? "∞"}{" "}
                    {step.session_toml && <button onClick={() => add(step)}>Add</button>}
                  </li>
                ))}
                {proposal.steps.length === 0 && <li>No candidate test improves it.</li>}
              </ul>
            )}
            <h2>Equation of {shownTest.name}, first order</h2>
            <Equation latex={latex} />
          </div>
        </div>
      )}
      <details>
        <summary>Texts of plan and machine</summary>
        <h2>plan.toml</h2>
        <Editor
          name="plan.toml"
          text={state.plan}
          fault={fault?.file === "plan.toml" ? fault : undefined}
          change={(plan) => change({ plan })}
        />
        <h2>machine.toml</h2>
        <Editor
          name="machine.toml"
          text={state.machine}
          fault={fault?.file === "machine.toml" ? fault : undefined}
          change={(machine) => change({ machine })}
        />
      </details>
    </>
  );
}

const textsOf = ({ machine, plan }: Shared) => `${machine}\0${plan}`;

function folderOf({ machine, plan }: Shared): [string, Uint8Array][] {
  const encode = new TextEncoder();
  return [
    ["machine.toml", encode.encode(machine)],
    ["plan.toml", encode.encode(plan)],
  ];
}

function caller(engine: Engine | undefined): Call {
  if (!engine) throw new Error("no worker");
  return (method, args, options) => engine.call(method, args, options);
}

function freeName(description: Description, name: string): string {
  const taken = new Set(description.tests.map((test) => test.name));
  let free = name;
  for (let number = 2; taken.has(free); number++) free = `${name}-${number}`;
  return free;
}
