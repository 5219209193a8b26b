"""Reading the rule files: where from, and how a fault is told."""

import shutil
from pathlib import Path

import pytest

from fras_planner.knowledge import AttachedRulesUnusable, attached_knowledge, load_knowledge
from fras_planner.planning import Knowledge, KnowledgeFault, Planner, PlanningScene

ASP = Path(__file__).resolve().parents[2] / "asp"
MAX_LINES = 80


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    return Path(shutil.copytree(ASP, tmp_path / "asp"))


def test_the_checkout_is_found(knowledge: Knowledge) -> None:
    assert {"domain.lp", "explain.lp", "preferences/weighted.lp"} <= set(knowledge.files)
    assert knowledge.criteria == ("capped", "lex", "literal", "nearest", "sum", "weighted")
    assert len(knowledge.digest) == 64
    assert knowledge.alphabet.arms == ("psm1", "psm2")


def test_every_file_is_short_and_says_what_it_is_for(knowledge: Knowledge) -> None:
    for name, text in knowledge.files.items():
        assert text.count("\n") < MAX_LINES, name
        header = text[: text.index("#program")]
        assert header.startswith(f"% {Path(name).name}:")
        assert "input" in header, name
        assert "output" in header, name


def test_the_digest_follows_every_byte(copy: Path, knowledge: Knowledge) -> None:
    assert load_knowledge(copy).digest == knowledge.digest
    with (copy / "preferences" / "lex.lp").open("a") as file:
        file.write("% a remark\n")
    assert load_knowledge(copy).digest != knowledge.digest


def test_a_rule_changed_changes_the_plan(copy: Path) -> None:
    names = ["b(1,1)", "b(1,2)", "b(1,3)"]
    rows = [(0, 0, 0), (0, 0.01, 0), (0, 0.02, 0)]
    statics = [*(f"reachable(psm1,{name})" for name in names), "fixed(b(1,1))"]
    scene = PlanningScene.make(names, rows, (0, 0.01, 0), statics)
    assert Planner(load_knowledge(copy), scene, "weighted").plan([]).target == "b(1,3)"
    weighted = copy / "preferences" / "weighted.lp"
    weighted.write_text(weighted.read_text().replace("2*Gap-Roi", "Gap-2*Roi"))
    assert Planner(load_knowledge(copy), scene, "weighted").plan([]).target == "b(1,2)"


def test_a_criterion_of_ones_own(copy: Path) -> None:
    own = "#program base.\npreference(B,-Gap,1) :- nearest_attachment(B,Gap).\n"
    (copy / "preferences" / "reckless.lp").write_text(own)
    assert "reckless" in load_knowledge(copy).criteria


NO_WORDS = "forbidden(reach(A,B),never) :- reachable(A,B).\n"


@pytest.mark.parametrize(
    ("rule", "name"),
    [
        (NO_WORDS, "never"),
        # One that does not bite in the tiny scene by which rules are tried out.
        ("forbidden(reach(A,B),late) :- reachable(A,B), B = b(9,9).\n", "late"),
        ("#program step(t).\nforbidden(pull,A,idle,t) :- in_hand(start,A,t).\n", "idle"),
    ],
)
def test_a_rule_that_nothing_declares_is_refused_for_it_would_not_count(
    copy: Path, rule: str, name: str
) -> None:
    constraints = copy / "constraints.lp"
    begun = constraints.read_text() + "#program base.\n"
    constraints.write_text(begun + rule)
    with pytest.raises(KnowledgeFault, match=f"add `rule.{name}.[.]` to part base") as told:
        load_knowledge(copy)
    assert told.value.file == str(constraints)
    assert told.value.line == begun.count("\n") + rule.count("\n")
    # What a log holds was taken by those of its time, and is derived as it was.
    files = {str(one.relative_to(copy)): one.read_text() for one in copy.rglob("*.lp")}
    assert attached_knowledge(files, "a.mcap").files == files
    constraints.write_text(begun + f"rule({name}).\n" + rule)
    assert load_knowledge(copy).files


def test_a_rule_without_words_is_blamed_by_its_name(copy: Path) -> None:
    with (copy / "constraints.lp").open("a") as file:
        file.write("#program base.\nrule(never).\n" + NO_WORDS)
    names, rows = ["b(1,1)", "b(1,2)"], [(0, 0, 0), (0, 0.01, 0)]
    statics = [f"reachable(psm1,{name})" for name in names]
    planner = Planner(load_knowledge(copy), PlanningScene.make(names, rows, (0, 0.01, 0), statics))
    none = planner.plan([]).no_plan
    assert none is not None
    assert "Rule: never, for which words.lp has no words." in none.sentences
    why_not = planner.why_not("reach(psm1,b(1,1))", [])
    assert "Rule: never, for which words.lp has no words." in why_not.sentences


@pytest.mark.parametrize(
    ("made", "problem"), [(False, "there is no such folder"), (True, "no domain.lp here")]
)
def test_a_folder_without_rules_is_told_what_belongs_there(
    tmp_path: Path, made: bool, problem: str
) -> None:
    folder = tmp_path / "rules"
    if made:
        folder.mkdir()
    with pytest.raises(KnowledgeFault, match=problem) as told:
        load_knowledge(folder)
    assert "a whole copy of asp/" in str(told.value)
    assert "mend the rule" not in str(told.value)


@pytest.mark.parametrize(
    ("rule", "said"),
    [
        ("rule(never)\n% a remark\nrule(late).\n", "the rule before lacks its full stop"),
        ("forbidden(reach(A,B),foo) :- reachable(A,_).\n", "a condition of the rule"),
        ("forbidden(reach(A,B),try_once) :- reacheable(A,B).\n", "misspelt"),
    ],
)
def test_what_clingo_says_is_told_with_what_is_likely(copy: Path, rule: str, said: str) -> None:
    with (copy / "constraints.lp").open("a") as file:
        file.write("#program base.\n" + rule)
    with pytest.raises(KnowledgeFault, match=said) as told:
        load_knowledge(copy)
    assert "<block>" not in str(told.value)
    assert "#inc" not in str(told.value)


@pytest.mark.parametrize(
    ("file", "rule", "says"),
    [
        ("effects.lp", "closed_gripper(A,t :- occurs(grasp,A,t-1).", "syntax error"),
        ("actions.lp", "busy(X) :- not busy(t-1).", "unsafe"),
        ("constraints.lp", "rule(x) :- clsoed_gripper(psm1).", "does not occur in any rule head"),
        ("preferences/sum.lp", "preference(B,1/0,1) :- block(B).", "operation undefined"),
        ("explain.lp", "sentence(0,X,()) :- does(_,_).", "unsafe"),
    ],
)
def test_a_fault_is_told_with_file_and_line(copy: Path, file: str, rule: str, says: str) -> None:
    path = copy / file
    line = path.read_text().count("\n") + 1
    with path.open("a") as out:
        out.write(rule + "\n")
    with pytest.raises(KnowledgeFault) as caught:
        load_knowledge(copy)
    assert (caught.value.file, caught.value.line) == (str(path), line)
    assert says in caught.value.message


@pytest.mark.parametrize(
    "rule", ['sentence(1,"{} {}",()).', 'sentence(1,hello,()).', 'sentence(foo,"x",()).',
             'sentence(1,"x").'],
)  # fmt: skip
def test_a_sentence_that_can_not_be_said_is_a_fault(copy: Path, rule: str) -> None:
    with (copy / "explain.lp").open("a") as out:
        out.write(f"#program explain.\n{rule}\n")
    with pytest.raises(KnowledgeFault, match="sentence"):
        load_knowledge(copy)


def test_what_a_file_leaves_open_is_its_own_fault(copy: Path) -> None:
    path = copy / "target.lp"
    with path.open("a") as out:
        out.write("preference(\n")
    with pytest.raises(KnowledgeFault, match="syntax error") as caught:
        load_knowledge(copy)
    assert (caught.value.file, caught.value.line) == (str(path), path.read_text().count("\n"))


def test_a_missing_file_is_named(copy: Path, tmp_path: Path) -> None:
    (copy / "goal.lp").unlink()
    with pytest.raises(KnowledgeFault, match=r"goal\.lp: this file is missing"):
        load_knowledge(copy)
    with pytest.raises(KnowledgeFault, match=r"no domain\.lp"):
        load_knowledge(tmp_path)


def test_knowledge_without_criteria_is_refused(copy: Path) -> None:
    shutil.rmtree(copy / "preferences")
    with pytest.raises(KnowledgeFault, match="no criterion"):
        load_knowledge(copy)


def test_text_that_is_no_text_is_named(copy: Path) -> None:
    (copy / "goal.lp").write_bytes(b"\xff\xfe")
    with pytest.raises(KnowledgeFault, match="can't be read"):
        load_knowledge(copy)


@pytest.mark.parametrize(
    ("rule", "word"),
    [
        ('#include "/etc/hostname".', "include"),
        ("#include <incmode>.", "include"),
        ("% *% #include\t'x'.", "include"),
        ("#script (lua)\n#end.", "script"),
        ("# script(python)\n#end.", "script"),
        ("#begin_lua\n#end_lua.", "begin_lua"),
    ],
)
def test_rules_that_reach_beyond_their_folder_are_refused(
    copy: Path, knowledge: Knowledge, rule: str, word: str
) -> None:
    """A log's own rules are run by whoever audits it: they get at no file and run no program."""
    path = copy / "goal.lp"
    line = path.read_text().count("\n") + 1
    with path.open("a") as out:
        out.write(rule + "\n")
    with pytest.raises(KnowledgeFault, match=f"#{word} is not allowed") as caught:
        load_knowledge(copy)
    assert (caught.value.file, caught.value.line) == (str(path), line)
    files = {**knowledge.files, "goal.lp": path.read_text()}
    with pytest.raises(AttachedRulesUnusable, match=rf"a\.mcap.*asp/goal\.lp:{line}: #{word}"):
        attached_knowledge(files, "a.mcap")


def test_attached_rules_are_the_same_knowledge(knowledge: Knowledge) -> None:
    attached = attached_knowledge(dict(sorted(knowledge.files.items(), reverse=True)), "a.mcap")
    assert attached.files == knowledge.files
    assert attached.digest == knowledge.digest
    rest = {name: text for name, text in knowledge.files.items() if name != "effects.lp"}
    with pytest.raises(AttachedRulesUnusable, match=r"a\.mcap.*asp/effects\.lp: this file is"):
        attached_knowledge(rest, "a.mcap")


def test_a_rule_that_puts_a_name_where_a_step_belongs_is_told(copy: Path) -> None:
    with (copy / "history.lp").open("a") as file:
        file.write("#program history.\nholds(visible_roi,soon).\n")
    with pytest.raises(KnowledgeFault, match="not of its form"):
        load_knowledge(copy)


def test_a_file_that_no_plan_needs_is_parsed_as_well(copy: Path) -> None:
    verify = copy / "verify.lp"
    verify.write_text(verify.read_text(encoding="utf-8") + "violation(X :- .\n", encoding="utf-8")
    with pytest.raises(KnowledgeFault, match=r"verify\.lp:\d+: "):
        load_knowledge(copy)
