#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes a C program that calls every function of include/kempe with what it must refuse: NULL for all pointers, NULL for
one of them, and each index and word out of range, everything else being right (tests/arguments.h). Each call has a
process of its own, so that a crash is a failure with a name.

    tests/arguments.py > arguments.c
"""
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[1]
# Arguments that may be NULL beside structs of options, and those that only NULL may be given to.
OPTIONAL = {"kempe_system_new_with_algorithm.dynamics", "kempe_model_new.name", "kempe_workspace_evaluate.qd", "kempe_workspace_evaluate_states.qd", "kempe_workspace_evaluate_states.failed", "kempe_workspace_forward_states.Q",
            "kempe_workspace_forward_states.lambda", "kempe_workspace_forward_states.failed", "kempe_workspace_forward_derivatives.Q", "kempe_workspace_forward_derivatives.lambda",
            "kempe_workspace_derivative_states.Q", "kempe_workspace_add_derivatives.names", "kempe_workspace_add_derivatives.outputs", "kempe_workspace_forward_jvp.Q", "kempe_workspace_forward_jvp.value", "kempe_workspace_forward_vjp.Q", "kempe_workspace_forward_vjp.value", "kempe_workspace_forward_second.Q", "kempe_workspace_forward_hessian.Q", "kempe_workspace_hessian_states.Q", "kempe_workspace_hessian_states.failed", "kempe_workspace_determinant_states.logarithm", "kempe_workspace_determinant_states.by_u", "kempe_workspace_determinant_states.by_uu", "kempe_workspace_determinant_states.failed", "kempe_workspace_step.Q", "kempe_workspace_add_actuators.weights", "kempe_workspace_actuator_forces.lambda", "kempe_workspace_derivative_states.lambda", "kempe_workspace_derivative_states.failed", "kempe_stepper_set_state.qd", "kempe_stepper_set_state.moved", "kempe_ensemble_stepper_begin.q", "kempe_ensemble_stepper_begin.qd", "kempe_ensemble_stepper_advance.outputs", "kempe_stepper_set_parameters.moved", "kempe_outputs_at_state.qd", "kempe_outputs_at_state.qdd", "kempe_outputs_at_state.lambda", "kempe_outputs_jacobian.qd", "kempe_outputs_jacobian.jdqd",
            "kempe_outputs_choose.independent", "kempe_outputs_closed_jacobian.qd", "kempe_outputs_closed_jacobian.drift", "kempe_workspace_forward_dynamics.Q",
            "kempe_workspace_forward_dynamics.lambda", "kempe_workspace_close.qd", "kempe_workspace_close.hold", "kempe_workspace_keep_modes.of", "kempe_gradient_eval.rates",
            "kempe_gradient_eval.accelerations", "kempe_gradient_eval.driven", "kempe_gradient_set.values",
            "kempe_model_read_set.settings", "kempe_model_read_text_set.settings", "kempe_values_new.names",
            "kempe_values_new.rows", "kempe_ensemble_run_rows.rows", "kempe_context_set_cache.folder", "kempe_context_set_base.base", "kempe_context_set_left_out.names",
            "kempe_context_set_text.text", "kempe_context_set_folder.folder", "kempe_workbench_new.folder", "kempe_model_start_at.q", "kempe_model_start_at.qd", "kempe_flow_at.jacobian"}
OPTIONS = ("_options",)
# Sizes of the caller's arrays, which cannot be checked: only negative ones are wrong.
SIZES = {"kempe_workspace_evaluate_states.count", "kempe_workspace_forward_states.count", "kempe_workspace_derivative_states.count", "kempe_workspace_forward_hessian.count", "kempe_workspace_hessian_states.count", "kempe_workspace_hessian_states.direction_count", "kempe_workspace_determinant_states.count", "kempe_workspace_add_derivatives.count", "kempe_contact_conicity.count", "kempe_flow_new.count"}
# Calls that do all that they do by default, with objects on which that is short.
SHORT = {"kempe_comparison_new.run": ("some_kempe_system(0)", "some_oscillating_system(0)")}
WRONG = ["-1", "1 << 30", "INT_MAX", "INT_MIN"]


def functions():
    for header in sorted(ROOT.glob("include/kempe/*.h")):
        if header.name == "runtime.h":
            continue
        text = re.sub(r"/\*.*?\*/", "", header.read_text(), flags=re.S)
        text = re.sub(r"^\s*#.*$", "", text, flags=re.M)
        for m in re.finditer(r"KEMPE_API\s+([^;{]*?)(\w+)\(([^;]*?)\);", text):
            words = re.sub(r"\s+", " ", m.group(3)).split(", ")
            yield m.group(1).strip(), m.group(2), [] if words == ["void"] else words


def name_of(word):
    return re.search(r"(\w+)(\[\d*\])?$", word).group(1)


def is_pointer(word):
    return "*" in word or "[" in word or "_fn" in word


def nothing(word):
    return "NULL" if is_pointer(word) else "kempe_value(0)" if "kempe_number " in word else "0"


def right(word):
    kind = re.sub(r"const |\*.*|\[.*|\s\w+$", "", word).strip()
    if "_fn" in word or "void *" in word:
        return "NULL"
    if "char *const" in word:
        return "some_names"
    if "char *" in word and "**" not in word:
        return '"/dev/null"'
    if "**" in word:
        return f"&(({word[: word.index('**')].replace('const ', '')}*){{0}})"
    if kind in ("double", "int") and is_pointer(word):
        return f"some_{kind}s"
    if is_pointer(word) and re.match(r"kempe_\w+ \*|const kempe_\w+ \*", word):
        return f"some_{kind}({'0' if word.startswith('const') else '1'})"
    return nothing(word)


def refuses(function, word):
    return is_pointer(word) and "_fn" not in word and "void *" not in word and not any(
        f"{o} *" in word for o in OPTIONS) and f"{function}.{name_of(word)}" not in OPTIONAL


def calls(result, function, words):
    """(what, arguments, whether a status must be KEMPE_E_ARGUMENT)"""
    yield "all NULL", [nothing(w) for w in words], any(refuses(function, w) for w in words)
    if function.endswith("_free") or function in ("kempe_context_set_log",):
        return
    for k, word in enumerate(words):
        long, short = SHORT.get(f"{function}.{name_of(word)}", ("", ""))
        others = [right(w).replace(long, short) if long else right(w) for w in words]
        if is_pointer(word):
            yield f"{name_of(word)} NULL", others[:k] + ["NULL"] + others[k + 1:], refuses(function, word)
        elif word.startswith("int ") or re.match(r"kempe_(?!number|status)\w+ \w+$", word):
            kind = re.sub(r" \w+$", "", word)
            for wrong in ["-1", "INT_MIN"] if f"{function}.{name_of(word)}" in SIZES else WRONG:
                yield f"{name_of(word)} {wrong}", others[:k] + [f"({kind})({wrong})"] + others[k + 1:], False


def main():
    print('#include "arguments.h"\n')
    names, makers = [], set()
    for result, function, words in functions():
        for what, arguments, refused in calls(result, function, words):
            call = f"{function}({', '.join(arguments)})"
            body = f"return {call} == KEMPE_E_ARGUMENT;" if refused and result == "kempe_status" else f"(void){call}; return 1;"
            if result == "void":
                body = f"{call}; return 1;"
            print(f"static int call_{len(names)}(void) {{ {body} }}")
            names.append(f"{function}, {what}")
            makers.update(re.findall(r"some_\w+\([01]\)", call))
    print("static const row rows[] = {")
    for k, name in enumerate(names):
        print(f'    {{"{name}", call_{k}}},')
    print("};\n\nint main(void)\n{")
    for maker in sorted(makers):
        print(f"    (void){maker};")
    print("    return call_all(rows, sizeof rows / sizeof *rows);\n}")


main()
