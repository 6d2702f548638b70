/* SPDX-License-Identifier: BSD-3-Clause */
/* Looking into a system: its equations, its program, its operation counts. */
#include "base/memory.h"
#include "results/assignments.h"
#include "results/print.h"
#include <string.h>

static const char *const stage_names[] = {"parameters", "closure: h, J, h_t", "mass: M", "bias: C, jdqd"};

/* The sets of equations that can be asked for one by one. */
typedef enum set { SET_M, SET_C, SET_H, SET_J, SET_JDQD, SETS } set;

static const struct {
    const char *name;
    unsigned derive;
} sets[SETS] = {{"M", KMP_SET_MASS},
                {"C", KMP_SET_BIAS},
                {"h", KMP_SET_CLOSURE},
                {"J", KMP_SET_CLOSURE},
                {"jdqd", KMP_SET_CLOSURE | KMP_SET_JDQD}};

/* -- equations --------------------------------------------------------------------------------------- */

static int set_size(const kmp_equations *eq, set s)
{
    switch (s) {
    case SET_M:
        return eq->n * (eq->n + 1) / 2;
    case SET_C:
        return eq->n;
    case SET_J:
        return eq->m * eq->n;
    case SET_H:
    case SET_JDQD:
    case SETS:
        break;
    }
    return eq->m;
}

static kmp_assignment *put_matrix(kmp_assignment *a, const char *name, int rows, int cols, bool lower,
                                  const kmp_ref *value)
{
    for (int i = 0; i < rows; i++)
        for (int k = 0; k < (lower ? i + 1 : cols); k++)
            *a++ = (kmp_assignment){name, i, k, value[i * cols + k]};
    return a;
}

static kmp_assignment *put_vector(kmp_assignment *a, const char *name, int count, const kmp_ref *value)
{
    for (int i = 0; i < count; i++)
        *a++ = (kmp_assignment){name, i, -1, value[i]};
    return a;
}

/* Appends the entries of one set; returns where the next one goes. */
static kmp_assignment *put_set(kmp_assignment *a, const kmp_equations *eq, set s)
{
    switch (s) {
    case SET_M:
        return put_matrix(a, "M", eq->n, eq->n, true, eq->mass);
    case SET_C:
        return put_vector(a, "C", eq->n, eq->bias);
    case SET_H:
        return put_vector(a, "h", eq->m, eq->h);
    case SET_J:
        return put_matrix(a, "J", eq->m, eq->n, false, eq->jacobian);
    case SET_JDQD:
        return put_vector(a, "jdqd", eq->m, eq->jdqd);
    case SETS:
        break;
    }
    return a;
}

/* What the indices mean. */
static void legend(kmp_text *text, const kempe_system *system)
{
    kmp_text_printf(text, "# %s: M qdd + C = J' lambda, h = 0, J qdd + jdqd = 0; entries not shown are zero\n# q:",
                    system->model->name);
    for (int k = 0; k < system->n; k++)
        kmp_text_printf(text, " %d %s", k + 1, system->model->motions[k].name);
    kmp_text_put(text, system->m ? "\n# h:" : "");
    for (int r = 0; r < system->m; r++)
        kmp_text_printf(text, " %d %s", r + 1, system->row_names[r]);
    kmp_text_put(text, "\n");
}

static kempe_status show_equations(kmp_text *text, const kempe_system *system)
{
    kmp_equations eq;
    const unsigned all = KMP_SET_MASS | KMP_SET_BIAS | KMP_SET_CLOSURE | KMP_SET_JDQD;
    kempe_status status = kmp_equations_init(&eq, system->model, all, KMP_SCHEME_COMPOSITE, false);
    if (status != KEMPE_OK)
        return status;
    int count = 0;
    for (set s = SET_M; s < SETS; s++)
        count += set_size(&eq, s);
    kmp_assignment *assignments = KMP_NEW(kmp_assignment, count), *end = assignments;
    for (set s = SET_M; assignments && s < SETS; s++)
        end = put_set(end, &eq, s);
    legend(text, system);
    if (!assignments || !kmp_assignments_print(&eq, count, assignments, text))
        status = kmp_fail_memory(system->context);
    kmp_free(assignments);
    kmp_equations_free(&eq);
    return status;
}

/* -- program ----------------------------------------------------------------------------------------- */

static kempe_status show_program(kmp_text *text, const kempe_system *system)
{
    kmp_program_print(system->motion, stage_names, text);
    return KEMPE_OK;
}

/* -- counts ------------------------------------------------------------------------------------------ */

typedef struct tally {
    kmp_counts counts;
    long created, kept; /* nodes of the graph; of the program: constants, inputs and instructions */
} tally;

static tally tally_of(const kmp_program *p, int first, int last)
{
    return (tally){kmp_program_count(p, first, last), (long)p->graph_nodes,
                   (long)p->constant_count + p->input_count + p->code[p->stages]};
}

/* A set alone: its own graph, its own program. */
static kempe_status tally_set(const kempe_system *system, set s, tally *t)
{
    kmp_equations eq;
    kempe_status status = kmp_equations_init(&eq, system->model, sets[s].derive, KMP_SCHEME_COMPOSITE, false);
    if (status != KEMPE_OK)
        return status;
    int count = set_size(&eq, s);
    kmp_assignment *assignments = KMP_NEW(kmp_assignment, count);
    kmp_ref *outputs = KMP_NEW(kmp_ref, count);
    kmp_program *program = NULL;
    if (assignments && outputs) {
        put_set(assignments, &eq, s);
        for (int k = 0; k < count; k++)
            outputs[k] = assignments[k].value;
        program = kmp_program_new(eq.graph, 1, &count, (const kmp_ref *const *)&outputs);
    }
    if (program)
        *t = tally_of(program, 0, 1);
    else
        status = kmp_fail_memory(system->context);
    kmp_program_free(program);
    kmp_free(assignments);
    kmp_free(outputs);
    kmp_equations_free(&eq);
    return status;
}

static kempe_status tally_sets(const kempe_system *system, tally t[SETS])
{
    for (set s = SET_M; s < SETS; s++) {
        kempe_status status = tally_set(system, s, &t[s]);
        if (status != KEMPE_OK)
            return status;
    }
    return KEMPE_OK;
}

static void show_counts(kmp_text *text, const char *name, const kmp_counts *c)
{
    kmp_text_printf(text, "  %-20s %7ld %7ld %7ld %7ld %7ld | %8ld %8ld", name, c->add, c->mul, c->div, c->trig,
                    c->other, c->paper, c->robotran);
}

static void show_header(kmp_text *text, const char *what, bool nodes)
{
    kmp_text_printf(text, "%-22s %7s %7s %7s %7s %7s | %8s %8s", what, "+ -", "*", "/", "sin cos", "other", "paper",
                    "robotran");
    kmp_text_printf(text, nodes ? " | %8s %8s\n" : "\n", "created", "kept");
}

static void show_stats(kmp_text *text, const kempe_system *system, const tally t[SETS])
{
    const kmp_program *p = system->motion;
    tally whole = tally_of(p, 0, p->stages - 1);
    show_header(text, "stage of the program", false);
    for (int s = 0; s < p->stages; s++) {
        kmp_counts c = kmp_program_count(p, s, s);
        show_counts(text, stage_names[s], &c);
        kmp_text_put(text, "\n");
    }
    kmp_text_put(text, "\n");
    show_header(text, "set", true);
    for (set s = SET_M; s < SETS; s++) {
        show_counts(text, sets[s].name, &t[s].counts);
        kmp_text_printf(text, " | %8ld %8ld\n", t[s].created, t[s].kept);
    }
    show_counts(text, "all in one program", &whole.counts);
    kmp_text_printf(text, " | %8ld %8ld\n\n", whole.created, whole.kept);
    kmp_text_put(text, "paper: + - * /   robotran: those and functions   created: nodes of the graph   kept: what the "
                       "program needs\n");
}

static void json_counts(kmp_json *json, const char *key, const kmp_counts *c)
{
    kmp_json_object(json, key);
    kmp_json_whole(json, "paper", c->paper);
    kmp_json_whole(json, "robotran", c->robotran);
    kmp_json_whole(json, "add", c->add);
    kmp_json_whole(json, "mul", c->mul);
    kmp_json_whole(json, "div", c->div);
    kmp_json_whole(json, "trig", c->trig);
    kmp_json_whole(json, "other", c->other);
}

static void json_tally(kmp_json *json, const char *key, const tally *t)
{
    json_counts(json, key, &t->counts);
    kmp_json_whole(json, "created", t->created);
    kmp_json_whole(json, "kept", t->kept);
    kmp_json_end(json);
}

static void json_stats(kmp_json *json, const kempe_system *system, const tally t[SETS])
{
    const kmp_program *p = system->motion;
    tally whole = tally_of(p, 0, p->stages - 1);
    kmp_json_object(json, "stages");
    for (int s = 0; s < p->stages; s++) {
        kmp_counts c = kmp_program_count(p, s, s);
        json_counts(json, stage_names[s], &c);
        kmp_json_end(json);
    }
    kmp_json_end(json);
    kmp_json_object(json, "sets");
    for (set s = SET_M; s < SETS; s++)
        json_tally(json, sets[s].name, &t[s]);
    json_tally(json, "all", &whole);
    kmp_json_end(json);
}

/* -- views ------------------------------------------------------------------------------------------- */

/* Each line of a view as one string. */
static void json_lines(kmp_json *json, kmp_text *view)
{
    kmp_json_array(json, "lines");
    for (char *s = view->s; s && *s;) {
        char *end = strchr(s, '\n');
        if (end)
            *end = '\0';
        kmp_json_string(json, NULL, s);
        s = end ? end + 1 : s + strlen(s);
    }
    kmp_json_end(json);
}

static kempe_status write_stats(kmp_text *out, const kempe_system *system, kempe_format format)
{
    tally t[SETS];
    kempe_status status = tally_sets(system, t);
    if (status != KEMPE_OK)
        return status;
    if (format == KEMPE_TEXT) {
        show_stats(out, system, t);
        return KEMPE_OK;
    }
    kmp_json json = kmp_json_begin(out);
    kmp_print_head(&json, system, KEMPE_OK, "", system->build_s);
    kmp_json_string(&json, "view", "stats");
    json_stats(&json, system, t);
    kmp_json_end(&json);
    return KEMPE_OK;
}

static kempe_status write_lines(kmp_text *out, const kempe_system *system, kempe_view view, kempe_format format)
{
    kmp_text lines = {0};
    bool equations = view == KEMPE_VIEW_EQUATIONS;
    kempe_status status = equations ? show_equations(&lines, system) : show_program(&lines, system);
    if (status == KEMPE_OK && format == KEMPE_TEXT) {
        kmp_text_put(out, lines.s ? lines.s : "");
    } else if (status == KEMPE_OK) {
        kmp_json json = kmp_json_begin(out);
        kmp_print_head(&json, system, KEMPE_OK, "", system->build_s);
        kmp_json_string(&json, "view", equations ? "equations" : "program");
        json_lines(&json, &lines);
        kmp_json_end(&json);
    }
    out->failed = out->failed || lines.failed;
    kmp_text_free(&lines);
    return status;
}

kempe_status kempe_system_print(const kempe_system *system, kempe_view view, kempe_format format, char **text)
{
    kmp_text out = {0};
    kmp_context_clear(system->context);
    kempe_status status =
        view == KEMPE_VIEW_STATS ? write_stats(&out, system, format) : write_lines(&out, system, view, format);
    if (status == KEMPE_OK)
        return kmp_print_finish(system->context, &out, text);
    kmp_text_free(&out);
    return status;
}
