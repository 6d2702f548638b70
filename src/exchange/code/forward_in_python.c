/* SPDX-License-Identifier: BSD-3-Clause */
#include "exchange/code/forward_in_python.h"
#include "exchange/code/start_choice.h"
#include "exchange/code/write.h"
#include <string.h>

/* An array that is needed, and the name of its variable. */
typedef struct need {
    const char *array, *variable;
} need;

static const need motion[] = {{"M", "mass"}, {"C", "bias"}, {"J", "jacobian"}, {"jdqd", "curvature"}},
                  closing[] = {{"h", "residuals"}, {"J", "jacobian"}};

/* Needs from `first` on, `count` of them, and the routines that give them, as bits. */
typedef struct calls {
    const need *needs;
    int count;
    uint64_t routines;
    unsigned arguments;
    const char *missing; /* an array that no routine without qdd and lambda gives; NULL: there is none */
} calls;

static bool gives(const kmp_code_routine *routine, const char *array)
{
    const unsigned motion_itself = 1u << KMP_IN_QDD | 1u << KMP_IN_LAMBDA;
    for (int a = 0; a < routine->array_count && !(routine->arguments & motion_itself); a++)
        if (strcmp(routine->arrays[a].name, array) == 0)
            return true;
    return false;
}

static calls find_calls(const kmp_code_source *source, const need *needs, int count)
{
    calls c = {.needs = needs, .count = count};
    for (int k = 0; k < count; k++) {
        int found = 0;
        while (found < source->count && !gives(&source->routines[found], needs[k].array))
            found++;
        if (found == source->count) {
            c.missing = needs[k].array;
            return c;
        }
        c.routines |= (uint64_t)1 << found;
        c.arguments |= source->routines[found].arguments;
    }
    return c;
}

/* "t, q, qd, u", and of a call with parameters p. */
static void put_arguments(const kmp_code_writer *w, unsigned arguments, const char *parameters)
{
    bool first = true;
    for (int kind = KMP_IN_TIME; kind < KMP_ARGUMENTS; kind++)
        if (arguments >> kind & 1) {
            kmp_text_printf(w->text, "%s%s", first ? "" : ", ", kmp_argument_names[kind]);
            first = false;
        }
    kmp_text_put(w->text, w->source->parameters ? parameters : "");
}

/* The first call that gives an array sets its variable; what another one gives again, or nothing needs, is `_`. */
static void put_calls(const kmp_code_writer *w, const calls *c, const char *indent)
{
    unsigned set = 0;
    for (int r = 0; r < w->source->count; r++) {
        const kmp_code_routine *routine = &w->source->routines[r];
        if (!(c->routines >> r & 1))
            continue;
        kmp_text_put(w->text, indent);
        for (int a = 0; a < routine->array_count; a++) {
            int k = 0;
            while (k < c->count && (set >> k & 1 || strcmp(c->needs[k].array, routine->arrays[a].name) != 0))
                k++;
            set |= k < c->count ? 1u << k : 0;
            kmp_text_printf(w->text, "%s%s", a ? ", " : "", k < c->count ? c->needs[k].variable : "_");
        }
        kmp_text_printf(w->text, " = %s(", routine->name);
        put_arguments(w, routine->arguments, ", p");
        kmp_text_put(w->text, ")\n");
    }
}

/* "{0: 1 - modes[1]}": what replaces the row of an element that neither sticks nor is closed. */
static void put_rest(const kmp_code_writer *w)
{
    const kmp_code_elements *const kinds[] = {&w->source->frictions, &w->source->contacts};
    const struct kmp_start_choice *choice = w->source->choice;
    bool first = true;
    kmp_text_put(w->text, "{");
    for (int kind = 0; kind < 2; kind++)
        for (int e = 0; e < kinds[kind]->count; e++)
            for (int k = 0; k < choice->row_count; k++)
                if (choice->rows[k] == kinds[kind]->row[e]) {
                    kmp_text_printf(w->text, "%s(%d, %d): 1.0 - modes[%d]", first ? "" : ", ", k, k,
                                    kinds[kind]->mode[e] + 1);
                    first = false;
                }
    kmp_text_put(w->text, "}");
}

static void put_head(const kmp_code_writer *w, const char *name, unsigned arguments, const char *more,
                     const char *meaning)
{
    kmp_text_printf(w->text, "\n\ndef %s(", name);
    put_arguments(w, arguments, ", p=parameter_values");
    kmp_text_printf(w->text, "%s):\n    \"\"\"%s\"\"\"\n", more, meaning);
}

static void put_motion(const kmp_code_writer *w, const calls *c)
{
    const bool loops = w->source->m > 0, elements = w->source->elements.count > 0;
    const char *arrays = loops ? "mass, bias, jacobian, curvature" : "mass, bias, None, None";
    put_head(w, "forward", c->arguments, "",
             "qdd and lambda_ at a closed state. lambda_ is 0 in rows that depend on others at the start.");
    put_calls(w, c, "    ");
    kmp_text_put(w->text, elements ? "    modes = _list(modes)\n" : "");
    kmp_text_printf(w->text, "    return _accelerations(%s, ", arrays);
    put_rest(w);
    kmp_text_put(w->text, ")\n");
    if (elements)
        return;
    put_head(w, "forward_reduced", c->arguments, "",
             "Accelerations of the coordinates `independent` at a closed state; the others follow from the closures.");
    put_calls(w, c, "    ");
    kmp_text_printf(w->text, "    return _reduced(%s)\n", arrays);
}

static void put_missing(const kmp_code_writer *w, const char *function, const char *before, const char *missing,
                        const char *after)
{
    kmp_text_printf(w->text, "\n\n# %s omitted, because it needs %s%s%s.\n", function, before, missing, after);
}

void kmp_put_forward(const kmp_code_writer *w)
{
    const kmp_code_source *source = w->source;
    const bool loops = source->m > 0;
    const calls of_motion = find_calls(source, motion, loops ? 4 : 2), of_closing = find_calls(source, closing, 2);
    if (source->choice->missing) {
        put_missing(w, "The function forward is", "", source->choice->missing, "");
        return;
    }
    kmp_fill(w, "\n\nindependent = $(independent)\ndependent = $(dependent)\nindependent_rows = $(independent rows)\n");
    kmp_runtime_put(w->text, KMP_RUNTIME_MOTION);
    if (of_motion.missing)
        put_missing(w, "The function forward is", "the array ", of_motion.missing,
                    " of a function without qdd and lambda_");
    else
        put_motion(w, &of_motion);
    if (!loops || source->elements.count > 0)
        return;
    if (of_closing.missing) {
        put_missing(w, "The function close is", "the array ", of_closing.missing, "");
    } else {
        put_head(w, "close", of_closing.arguments, ", steps=6",
                 "q with the coordinates `dependent` moved by steps of Newton's method, so that the closures are met.");
        kmp_text_put(w->text, "    q = _vector(dict(enumerate(_list(q))), len(coordinate_names))\n"
                              "    for _ in range(steps):\n");
        put_calls(w, &of_closing, "        ");
        kmp_text_put(w->text, "        q = _step(q, residuals, jacobian)\n    return q\n");
    }
}
