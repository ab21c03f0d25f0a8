// Explore: a plan that changes while it is looked at. The texts of machine and plan are the state; everything else
// follows from them.

import { zipSync } from "fflate";
import { useEffect, useRef, useState } from "preact/hooks";
import { bundled } from "./bundled";
import { Charts } from "./charts";
import { Editor } from "./editor";
import { Equation } from "./equation";
import { FaultBox, faultOf } from "./fault";
import { download } from "./files";
import { Identifiability } from "./identifiability";
import type { Opened } from "./main";
import { useNarrow } from "./narrow";
import { NextTest } from "./next-test";
import { folderOf, freeName, type ProposedTest, planOf, TEMPLATES, templateOf, textsOf } from "./plan";
import { type Field, fieldAt, tests, withBall, withCopy, withoutTest, withPart, withValue } from "./plan-text";
import type { Fault } from "./protocol";
import { SetUpView } from "./set-up";
import { type Shared, toFragment } from "./share";
import { Sliders } from "./sliders";
import { TestForm } from "./test-form";
import { changed, redone, startOf, type Timeline, undone } from "./timeline";
import { type Kind, usePlan } from "./use-plan";
import { keptValue, useKeeping, useUnsaved } from "./work";

interface Props {
  opened?: Opened;
  shared?: Shared;
  analyse: (opened: Opened) => void;
}

/** What this view keeps: the plan with what it was before, and the last one that could be used. */
export interface KeptPlan {
  timeline: Timeline<Shared>;
  valid?: Shared;
  isChanged: boolean;
}

/** Changes of one thing that follow one another within this time are one step of undo, ms. */
const ONE_STEP_MS = 1000;

const sizeOf = ({ machine, plan }: Shared) => machine.length + plan.length;

export function Explore({ opened, shared, analyse }: Props) {
  const keeping = useKeeping();
  const kept = useRef(keptValue<KeptPlan>(keeping, "plan")).current;
  const [timeline, setTimeline] = useState(() => {
    const given = opened ? planOf(opened) : shared;
    if (kept && given) return changed(kept.timeline, given, false, sizeOf);
    return kept?.timeline ?? startOf(given ?? templateOf(TEMPLATES[0]));
  });
  const state = timeline.present;
  const [kind, setKind] = useState<Kind>("patterns");
  const [test, setTest] = useState(0);
  const [code, setCode] = useState("[wCAbXYZt]");
  const [codeFault, setCodeFault] = useState<Fault>();
  const [isShareable, setIsShareable] = useState(true);
  const [isChanged, setIsChanged] = useState(kept?.isChanged ?? false);
  /** The pictures of changes: how many there were, and how long the last took. */
  const [picture, setPicture] = useState({ number: 0, milliseconds: 0 });
  const since = useRef(0);
  const isNarrow = useNarrow();
  const followed = usePlan(state, kind, test, kept?.valid);
  const { description, curves, analysis, latex, valid, engine } = followed;
  useUnsaved("Explore", isChanged);
  useEffect(() => {
    const work: KeptPlan = { timeline, valid, isChanged };
    keeping.store.keep("plan", work);
  }, [timeline, valid, isChanged]);
  useEffect(() => {
    const timer = setTimeout(() => {
      const fragment = toFragment(state);
      setIsShareable(fragment !== undefined);
      history.replaceState(null, "", fragment ?? "#");
    }, 300);
    return () => clearTimeout(timer);
  }, [state]);

  const drawn = () => {
    if (!since.current) return;
    const from = since.current;
    since.current = 0;
    // After the other charts, which are drawn in the same turn.
    queueMicrotask(() => {
      const milliseconds = performance.now() - from;
      setPicture(({ number }) => ({ number: number + 1, milliseconds }));
    });
  };
  /** The field that was changed last: it has the fault of a plan that then cannot be used. */
  const edited = useRef<Field | undefined>(undefined);
  const lastChange = useRef({ what: "", at: 0 });
  /** Changes the plan. Changes of the same thing in a row, `what`, are one step of undo. */
  const change = (edit: (before: Shared) => Shared, what = "", field?: Field) => {
    since.current ||= performance.now();
    const now = performance.now();
    const continues = what !== "" && what === lastChange.current.what && now - lastChange.current.at < ONE_STEP_MS;
    lastChange.current = { what, at: now };
    edited.current = field;
    setCodeFault(undefined);
    setIsChanged(true);
    setTimeline((line) => changed(line, edit(line.present), continues, sizeOf));
  };
  const changePlan = (edit: (plan: string) => string, what?: string, field?: Field) =>
    change((before) => ({ ...before, plan: edit(before.plan) }), what, field);
  const open = (next: Shared) => {
    setTest(0);
    change(() => next);
    setIsChanged(false);
  };
  const step = (to: typeof undone) => {
    lastChange.current = { what: "", at: 0 };
    edited.current = undefined;
    setCodeFault(undefined);
    setIsChanged(true);
    setTimeline((line) => to(line));
  };
  const fromCode = async () => {
    try {
      const made = await engine.call<Record<string, string>>("filesOfCode", [code]);
      open({ machine: made["machine.toml"], plan: made["plan.toml"], values: {} });
    } catch (error) {
      setCodeFault(faultOf(error));
    }
  };
  const add = ({ name, session_toml }: ProposedTest) => {
    const free = JSON.stringify(description ? freeName(description, name) : name);
    changePlan((plan) => withValue(`${plan.trimEnd()}\n\n${session_toml}`, tests(plan), "name", free));
  };
  const given = useRef({ opened, shared });
  useEffect(() => {
    const before = given.current;
    given.current = { opened, shared };
    if (opened && opened !== before.opened) open(planOf(opened));
    else if (shared && shared !== before.shared) open(shared);
  }, [opened, shared]);
  const texts = useRef<HTMLDetailsElement>(null);
  const press = (event: KeyboardEvent) => {
    // A field of text takes back what is typed in it.
    const isText = event.target instanceof HTMLElement && event.target.matches("textarea, input:not([type='range'])");
    if (isText || !(event.ctrlKey || event.metaKey)) return;
    const key = event.key.toLowerCase();
    if (key === "z" || key === "y") {
      event.preventDefault();
      step(key === "y" || event.shiftKey ? redone : undone);
    }
  };
  useEffect(() => {
    const isHere = () => !texts.current?.closest("section")?.hidden;
    const listen = (event: KeyboardEvent) => isHere() && press(event);
    addEventListener("keydown", listen);
    return () => removeEventListener("keydown", listen);
  }, []);

  const fault = codeFault ?? followed.fault;
  const field = fault && faultField(fault, state.plan, edited.current);
  const isLast = valid === undefined || textsOf(valid) === textsOf(state);
  const shownTest = description?.tests[Math.min(test, description.tests.length - 1)];
  const form = description && shownTest && (
    <>
      <p class="note">
        {description.machine}: {description.chain}
      </p>
      <TestForm
        description={description}
        test={test}
        plan={state.plan}
        fault={fault && field && { field, why: fault.message }}
        select={setTest}
        set={(key, written) =>
          changePlan((plan) => withValue(plan, test, key, written), `${test} ${key}`, { test, key })
        }
        place={(ball, written, part) =>
          changePlan((plan) => withBall(plan, test, ball, written), `${test} ${ball} ${part}`, {
            test,
            key: ball,
            part,
          })
        }
        setPart={(key, part, written, number) =>
          changePlan((plan) => withValue(plan, test, key, withPart(written, part, number)), `${test} ${key} ${part}`, {
            test,
            key,
            part,
          })
        }
        copy={() => changePlan((plan) => withCopy(plan, test, freeName(description, `${shownTest.name}-2`)))}
        remove={() => {
          changePlan((plan) => withoutTest(plan, test));
          setTest(0);
        }}
      />
    </>
  );
  const sliders = description && (
    <Sliders
      parameters={description.parameters}
      values={state.values}
      set={(values, what) => change((before) => ({ ...before, values }), what && `slider ${what}`)}
    />
  );
  const setUp = description && shownTest && (
    <SetUpView
      setUp={shownTest}
      of={description}
      axes={description.axes}
      dragged={(ball, to) =>
        changePlan((plan) => withBall(plan, test, ball, `[${to.join(", ")}]`), `drag ${test} ${ball}`)
      }
    />
  );
  const charts = description && (
    <>
      <p class="actions">
        <label>
          Show{" "}
          <select value={kind} onChange={(event) => setKind(event.currentTarget.value as Kind)}>
            <option value="patterns">trace patterns: change of the readings</option>
            <option value="sensitivities">sensitivities: change per unit of each error</option>
          </select>
        </label>
        <span class="note" data-ms={picture.milliseconds.toFixed(1)} data-pictures={picture.number}>
          {picture.number > 0 && `${picture.milliseconds.toFixed(0)} ms from change to picture`}
        </span>
      </p>
      <Charts description={description} curves={curves} kind={kind} test={test} scrolls={isNarrow} drawn={drawn} />
    </>
  );
  const findings = shownTest && (
    <>
      {analysis && <Identifiability analysis={analysis} />}
      <NextTest improve={followed.improve} stop={followed.stop} of={state.plan} add={add} />
      <h2>Equation of {shownTest.name}, first order</h2>
      <Equation latex={latex} />
    </>
  );
  return (
    <>
      <form
        class="actions"
        onSubmit={(event) => {
          event.preventDefault();
          void fromCode();
        }}
      >
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
        <button>Create</button>
      </form>
      <p class="actions">
        <button disabled={timeline.past.length === 0} onClick={() => step(undone)}>
          Undo
        </button>
        <button disabled={timeline.future.length === 0} onClick={() => step(redone)}>
          Redo
        </button>
        <button
          onClick={() => {
            const files = Object.fromEntries(folderOf(state));
            download("plan.zip", new Uint8Array(zipSync(files)), "application/zip");
            setIsChanged(false);
          }}
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
        <button onClick={() => analyse({ files: folderOf(state), session: "plan.toml" })}>Open in Analyse</button>
      </p>
      {fault && (
        <FaultBox
          fault={fault}
          go={({ file }) => {
            if (field) setTest(field.test);
            if (file && texts.current) texts.current.open = true;
          }}
        >
          {!isLast && valid && (
            <p class="actions">
              What is shown is the last plan that can be used.
              <button onClick={() => change(({ values }) => ({ ...valid, values }))}>Go back to it</button>
            </p>
          )}
        </FaultBox>
      )}
      {isNarrow ? (
        <>
          {form}
          {setUp}
          <div class="together">
            <div class="stays">{charts}</div>
            {sliders}
          </div>
          {findings}
        </>
      ) : (
        <div class="columns">
          <div>
            {form}
            {sliders}
          </div>
          <div>
            {setUp}
            {charts}
            {findings}
          </div>
        </div>
      )}
      <details ref={texts}>
        <summary>Texts of plan and machine</summary>
        <h2>plan.toml</h2>
        <Editor
          name="plan.toml"
          text={state.plan}
          fault={fault?.file === "plan.toml" ? fault : undefined}
          change={(plan) => changePlan(() => plan, "text of the plan")}
        />
        <h2>machine.toml</h2>
        <Editor
          name="machine.toml"
          text={state.machine}
          fault={fault?.file === "machine.toml" ? fault : undefined}
          change={(machine) => change((before) => ({ ...before, machine }), "text of the machine")}
        />
      </details>
    </>
  );
}

/** The field of a fault: that at its place, or that which was changed last. */
function faultField(fault: Fault, plan: string, edited?: Field): Field | undefined {
  const found = fault.file === "plan.toml" && fault.line ? fieldAt(plan, fault.line, fault.column ?? 1) : undefined;
  if (!found || !edited) return found ?? edited;
  // A fault of a whole test is due to what was changed in it. A ball of several tests is changed in all of them: the
  // fault stands where it was changed.
  const isOfEdited = found.key === undefined ? found.test === edited.test : found.key === edited.key;
  return isOfEdited ? { ...edited, part: found.part ?? edited.part } : found;
}
