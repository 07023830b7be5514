"""What the validation layer says is understood, and only known messages of upstream are let pass; `make adapters` runs the layer itself."""

import json
import re
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "scripts"))
import vulkan_layer
from vulkan_layer import ROOT, Message, is_upstream, judged

NAGA = """(spirv-val produced an error):
Invalid explicit layout decorations on type '11[%11]', the Function storage class has an explicit layout from the Offset decoration
  %86 = OpVariable %_ptr_Function__struct_11 Function %88
"""
LAYOUT = "VUID-StandaloneSpirv-None-10684"
SHADOW = (
    "Inside [VK_SHADER_STAGE_FRAGMENT_BIT], it writes to [Output variable, Location 0], but there is no "
    "VkSubpassDescription::pColorAttachments[0] and this write is unused."
)
UNUSED = "Undefined-Value-ShaderOutputNotConsumed"
HAZARD = "SYNC-HAZARD-WRITE-AFTER-WRITE"


def said(id: str, severity: str, text: str) -> str:
    """Write a message as the layer does, indented JSON with nothing after it but the next."""
    return json.dumps({"Severity": severity, "VUID": id, "Objects": [], "MainMessage": text}, indent="\t") + "\n"


BANNER = said(vulkan_layer.BANNER, "Information", "Current Validation Enabled:\n  - Core Checks\n  - Synchronization\n")


def test_a_clean_log_is_clean_and_a_hazard_is_not() -> None:
    clean = judged(BANNER, 0)
    assert not clean.problems and not clean.messages
    known = judged(BANNER + said(LAYOUT, "Error", NAGA) * 2 + said(UNUSED, "Warning", SHADOW), 0)
    assert not known.problems and len(known.messages) == 3 and not known.ours()
    hazard = judged(BANNER + said(LAYOUT, "Error", NAGA) + said(HAZARD, "Error", "hazard detected"), 0)
    assert not hazard.problems and hazard.ours() == [Message(HAZARD, "Error", "hazard detected")]


@pytest.mark.parametrize(
    ("log", "code", "problem"),
    [
        ("", 0, "not there"),
        (said(vulkan_layer.BANNER, "Information", "Current Validation Enabled:\n  - Core Checks\n"), 0, "synchronisation"),
        (said(LAYOUT, "Error", NAGA), 0, "not there"),
        (BANNER + said(HAZARD, "Error", "hazard")[:-9], 0, "cut off"),
        (BANNER, -11, "exit code -11"),
    ],
)
def test_silence_is_not_taken_for_clean(log: str, code: int, problem: str) -> None:
    assert any(problem in one for one in judged(log, code).problems)


@pytest.mark.parametrize(
    "message",
    [
        Message(LAYOUT, "Error", NAGA.replace("Function storage", "StorageBuffer storage")),
        Message(LAYOUT, "Error", "All variables must have valid explicit layout decorations"),
        Message(UNUSED, "Error", SHADOW),
        Message(UNUSED, "Warning", SHADOW.replace("Location 0", "Location 1")),
        Message(UNUSED + "-DynamicRendering", "Warning", SHADOW),
    ],
)
def test_a_known_id_with_other_words_is_not_let_pass(message: Message) -> None:
    assert not is_upstream(message)


def test_entry_points_that_no_command_runs_are_noticed() -> None:
    every = vulkan_layer.entry_points()
    assert len(every) > 50 and "scatter/march/walk.wgsl:march" in every
    assert not vulkan_layer.unused(every)
    assert vulkan_layer.unused(every - {"scatter/march/walk.wgsl:march"}) == {"scatter/march/walk.wgsl:march"}
    # an entry point of an included file runs as one of the file that includes it
    scan = {one for one in every if one.startswith("scatter/epipolar/scan")}
    assert not vulkan_layer.unused(every - scan | {"scatter/epipolar/scan_one.wgsl:scan"})
    for path in vulkan_layer.ELSEWHERE:
        assert any(one.startswith(f"{path}:") for one in every), path


def test_the_page_names_the_commands_and_what_is_let_pass() -> None:
    page = re.sub(r"\s+", " ", (ROOT / "docs" / "vulkan-layer.md").read_text(encoding="utf-8"))
    for name, command in vulkan_layer.COMMANDS.items():
        assert f"`{name}`" in page, f"{name}: {' '.join(command)}"
    for id in vulkan_layer.UPSTREAM:
        assert f"`{id}`" in page
