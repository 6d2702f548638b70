/* SPDX-License-Identifier: BSD-3-Clause */
/* The C file with the table of equations that kempe_simulator.c reads: names, sizes, a start, and functions of one
 * form for all models. */
#include "exchange/code/simulator_pages.h"
#include "backend/bounds.h"
#include "backend/time_scales.h"
#include "base/text.h"
#include "dynamics/equations.h"
#include "exchange/code/runtime_files.h"
#include "exchange/code/simulated.h"
#include "exchange/code/write.h"
#include "symbolic/table_function.h"
#include <kempe/kempe.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

/* -- lists --------------------------------------------------------------------------------------------- */

typedef void put_list(kmp_text *text, const char *name, int count, const void *list);

static void put_ints(kmp_text *text, const char *name, int count, const void *list)
{
    const int *x = list;
    kmp_text_printf(text, "static const int %s[] = ", name);
    for (int k = 0; k < count; k++)
        kmp_text_printf(text, "%s%d", k == 0 ? "{" : k % 20 == 0 ? ",\n    " : ", ", x[k]);
    kmp_text_printf(text, "%s};\n", count ? "" : "{0");
}

static void put_doubles(kmp_text *text, const char *name, int count, const void *list)
{
    kmp_text_printf(text, "static const double %s[] = ", name);
    if (count > 0)
        kmp_put_numbers(text, &kmp_language_c, &kmp_language_c.numbers, count, list);
    kmp_text_put(text, count > 0 ? ";\n" : "{0};\n");
}

static void put_names(kmp_text *text, const char *name, int count, const void *list)
{
    char *const *names = list;
    kmp_text_printf(text, "static const char *const %s[] = ", name);
    for (int k = 0; k < count; k++) {
        kmp_put_list_item(text, &kmp_language_c.names, k);
        kmp_language_string(text, &kmp_language_c, names[k]);
    }
    kmp_text_printf(text, "%s};\n", count ? "" : "{\"\"");
}

/* -- functions ----------------------------------------------------------------------------------------- */

/* The place in k where the values of a routine begin; of NULL: their number. */
static int place_in_k(const kmp_code_source *s, const char *name)
{
    int at = 0;
    for (int k = 0; s->routines && k < s->count; k++) {
        const kmp_code_routine *r = &s->routines[k];
        if (name && strcmp(r->name, name) == 0)
            break;
        at += r->kept_count ? r->kept_count : 1;
    }
    return at;
}

/* A function that passes the arguments on; `way`: after the modes. */
static void put_call(kmp_text *text, const kmp_code_source *s, const char *name, const char *way, const char *results)
{
    if (!kmp_simulated_routine(s, name))
        return;
    kmp_text_printf(
        text, "    %s_%s(at->k + %d, at->t, at->q, at->qd, at->qdd, at->lambda, at->modes, at->chart%s, at->u, %s);\n",
        s->name, name, place_in_k(s, name), way, results);
}

static void put_function(kmp_text *text, const kmp_code_source *s, const char *function, const char *parameters,
                         const char *results)
{
    const char *name = strcmp(function, "watch_values") == 0 ? "changes" : function;
    kmp_text_printf(text, "static void %s(const kempe_arguments *at, %s)\n{\n", function, parameters);
    put_call(text, s, name, "", results);
    if (!kmp_simulated_routine(s, name))
        kmp_text_printf(text, "    (void)at, (void)%s;\n", results);
    kmp_text_put(text, "}\n\n");
}

/* Conditions, without the unknowns of their implicit blocks, and with them. */
static void put_changes(kmp_text *text, const kmp_code_source *s)
{
    const struct kmp_simulated *x = s->simulated;
    const bool solved = x->watch_solved > 0;
    put_function(text, s, solved ? "watch_values" : "changes", "double *value", "value");
    if (solved)
        kmp_text_printf(
            text,
            "static void changes(const kempe_arguments *at, double *value)\n{\n    double all[%d];\n"
            "    watch_values(at, all);\n    for (int i = 0; i < %d; i++)\n        value[i] = all[i];\n}\n\n",
            x->condition_count + x->watch_solved, x->condition_count);
}

/* The direction as one array, and the changes apart. */
static void put_along(kmp_text *text, const kmp_code_source *s)
{
    const kmp_directions at = kmp_equations_directions(s->model, s->m);
    const int n = s->n, m = s->m, w = s->output_count, c = s->simulated->condition_count;
    const struct {
        const char *name;
        int count;
    } parts[] = {{"dynamics", n}, {"h", m}, {"rates", m}, {"accelerations", m}, {"y", w}, {"value", c}};
    kmp_text_put(text, "static void take(double *to, const double *from, int count)\n{\n"
                       "    for (int i = 0; i < count; i++)\n        to[i] = from ? from[i] : 0;\n}\n\n");
    kmp_text_put(text,
                 "static void along(const kempe_arguments *at, const kempe_direction *direction, double *dynamics, "
                 "double *h,\n                  double *rates, double *accelerations, double *y, double *value)\n{\n");
    kmp_text_printf(text, "    double way[%d] = {0}, slope[%d];\n    way[0] = direction->t;\n", at.count,
                    n + 3 * m + w + c + 1);
    kmp_text_printf(text, "    take(way + 1, direction->u, %d);\n", at.parameters - 1);
    kmp_text_printf(
        text, "    for (int i = 0; direction->p && i < %d; i++)\n        way[%d + symbol[i]] = direction->p[i];\n",
        s->parameter_count, at.parameters);
    kmp_text_printf(text, "    take(way + %d, direction->q, %d);\n    take(way + %d, direction->qd, %d);\n", at.q, n,
                    at.qd, n);
    kmp_text_printf(text, "    take(way + %d, direction->qdd, %d);\n    take(way + %d, direction->lambda, %d);\n",
                    at.qdd, n, at.lambda, m);
    put_call(text, s, "along", ", way", "slope");
    for (int k = 0, first = 0; k < (int)(sizeof parts / sizeof *parts); first += parts[k++].count)
        kmp_text_printf(text, "    if (%s)\n        take(%s, slope + %d, %d);\n", parts[k].name, parts[k].name, first,
                        parts[k].count);
    kmp_text_put(text, "}\n\n");
}

/* -- bounds of conditions ---------------------------------------------------------------------------- */

static void put_numbered(kmp_text *text, const char *name, int number, int count, const double *x)
{
    char full[32];
    snprintf(full, sizeof full, "%s%d", name, number);
    put_doubles(text, full, count, x);
}

/* The table `watch`, after the tables that it names. */
static void put_watch(kmp_text *text, const kmp_code_source *s)
{
    const struct kmp_simulated *x = s->simulated;
    if (!x->watch)
        return;
    const kmp_program *p = kmp_simulated_routine(s, "changes")->program;
    const kmp_bound_code *code = &x->watch->code;
    for (int k = 0; k < p->table_count; k++) {
        const kmp_table *t = p->table[k];
        put_numbered(text, "watch_x", k, t->count, t->x);
        put_numbered(text, "watch_y", k, t->count, t->y);
        put_numbered(text, "watch_pieces", k, 4 * (t->count - 1), t->piece[0]);
    }
    for (int k = 0; k < p->table_count; k++)
        kmp_text_printf(text, "%s{%d, %d, watch_x%d, watch_y%d, watch_pieces%d}%s",
                        k ? ",\n    " : "static const kempe_watch_table watch_tables[] = {", p->table[k]->count,
                        kmp_table_degree(p->table[k]), k, k, k, k + 1 < p->table_count ? "" : "};\n");
    put_numbered(text, "watch_constants", 0, code->constants, code->constant);
    put_ints(text, "watch_inputs", 2 * code->inputs, x->watch_input);
    kmp_text_put(text, "static const unsigned watch_steps[] = {");
    for (int k = 0; k < code->steps; k++)
        kmp_text_printf(text, "%s%u, %u, %u, %u", k ? k % 5 == 0 ? ",\n    " : ", " : "", code->step[k].op,
                        code->step[k].a, code->step[k].b, code->step[k].c);
    kmp_text_printf(text, "%s};\nstatic const unsigned watch_outputs[] = {", code->steps ? "" : "0");
    for (int k = 0; k < x->condition_count + x->watch_solved; k++)
        kmp_text_printf(text, "%s%u", k ? k % 20 == 0 ? ",\n    " : ", " : "", x->watch->output[x->watch_first + k]);
    kmp_text_put(text, "};\n");
    put_ints(text, "watch_traits", x->condition_count, x->watch_traits);
    kmp_text_printf(
        text,
        "static const kempe_watch watch = {%d, %d, %d, %d, %d, %d, watch_constants0, watch_inputs, watch_steps, "
        "watch_outputs,\n    watch_traits, %s, %s, kempe_watch_search};\n\n",
        code->constants, code->inputs, code->steps, p->table_count, code->fixed, x->watch_solved,
        p->table_count > 0 ? "watch_tables" : "0", x->watch_solved > 0 ? "watch_values" : "0");
}

/* -- pages --------------------------------------------------------------------------------------------- */

/* Lists that the table of equations refers to by their names. */
typedef struct listed {
    const char *name;
    put_list *put;
    int count;
    const void *list;
} listed;

enum { LISTS = 17 };

static void find_lists(const kmp_code_source *s, listed lists[LISTS])
{
    const struct kmp_simulated *x = s->simulated;
    const listed all[LISTS] = {{"coordinate_names", put_names, s->n, s->coordinate_names},
                               {"row_names", put_names, s->m, s->row_names},
                               {"input_names", put_names, s->input_count, s->input_names},
                               {"input_moves", put_names, s->input_count, x->moved},
                               {"parameter_names", put_names, s->parameter_count, s->parameter_name},
                               {"condition_names", put_names, x->condition_count, x->condition_name},
                               {"output_names", put_names, s->output_count, s->output_names},
                               {"advice", put_names, x->condition_count, x->advice},
                               {"coordinate_kind", put_ints, s->n, x->coordinate_kind},
                               {"condition_kind", put_ints, x->condition_count, x->condition_kind},
                               {"parameter_fixed", put_ints, s->parameter_count, x->fixed},
                               {"jacobian_zeros", put_names, s->m, x->jacobian_zeros},
                               {"mass_zeros", put_names, s->n, x->mass_zeros},
                               {"scale", put_doubles, s->n, x->scale},
                               {"row_scale", put_doubles, s->m, x->row_scale},
                               {"parameter_values", put_doubles, s->parameter_count, s->value},
                               {"input_values", put_doubles, KMP_TIME_NUMBERS * s->input_count, x->inputs}};
    memcpy(lists, all, sizeof all);
}

static void put_friction(kmp_text *text, const kmp_code_source *s)
{
    const struct kmp_simulated_friction *f = &s->simulated->friction;
    const int count = s->simulated->friction_count;
    if (count == 0)
        return;
    put_ints(text, "friction_slot", count, f->slot);
    put_ints(text, "friction_row", count, f->row);
    put_ints(text, "friction_base", count, f->base);
    put_ints(text, "friction_across", count, f->across);
    put_ints(text, "friction_twin", count, f->twin);
    put_ints(text, "friction_loaded", count, f->loaded);
    put_ints(text, "friction_sides", count, f->sides);
    put_ints(text, "friction_unlimited", count, f->unlimited);
    put_ints(text, "friction_contact", count, f->contact);
    put_doubles(text, "friction_size", count, f->size);
    put_doubles(text, "friction_regularise", count, f->regularise);
    kmp_text_printf(
        text,
        "static const kempe_friction friction = {%d, friction_slot, friction_row, friction_base,\n"
        "    friction_across, friction_twin, friction_loaded, friction_sides, friction_unlimited,\n"
        "    friction_size, friction_regularise, %d,\n"
        "    friction_contact, %d, %d, %d,\n"
        "    kempe_friction_begin, kempe_friction_note, kempe_friction_let_go, kempe_friction_settle%s};\n\n",
        count, f->loads, f->contacts, f->driven, f->rolls,
        f->contacts > 0 ? ",\n    kempe_friction_strike, kempe_friction_overlap" : ", 0, 0");
}

static void put_charts(kmp_text *text, const kmp_code_source *s)
{
    const struct kmp_simulated *x = s->simulated;
    if (x->chart_count == 0)
        return;
    put_ints(text, "chart_first", x->chart_count, x->chart_first);
    put_ints(text, "chart_before", x->chart_count, x->chart_before);
    put_doubles(text, "chart_axes", 9 * x->chart_count, x->chart_axes);
    kmp_text_printf(text,
                    "static const kempe_charts charts = {%d, chart_first, chart_before, chart_axes,\n"
                    "    kempe_chart_regular, kempe_chart_center, kempe_chart_follow, kempe_chart_show, "
                    "kempe_chart_carry};\n\n",
                    x->chart_count);
}

static void put_start(kmp_text *text, const kmp_code_source *s)
{
    const struct kmp_simulated *x = s->simulated;
    put_doubles(text, "start_q", s->n, x->q);
    put_doubles(text, "start_qd", s->n, x->qd);
    put_ints(text, "independent", x->freedom, x->independent);
    put_doubles(text, "start_given", 2 * s->n, x->given);
    put_ints(text, "start_keeps", s->n, x->keeps);
}

static void put_discrete(kmp_text *text, const kmp_code_source *s)
{
    const struct kmp_simulated *x = s->simulated;
    put_ints(text, "discrete_place", s->discrete_count, s->discrete_place);
    put_doubles(text, "discrete_period", s->discrete_count, s->discrete_time);
    put_ints(text, "discrete_condition", s->discrete_count, x->event);
    put_ints(text, "discrete_sense", s->discrete_count, x->sense);
    put_ints(text, "discrete_settles", s->discrete_count, x->settles);
}

static void put_number(kmp_text *text, const char *name, double x)
{
    kmp_text_printf(text, "    .%s = ", name);
    kmp_language_number(text, &kmp_language_c, x);
    kmp_text_put(text, ",\n");
}

static void put_equations(kmp_text *text, const kmp_code_source *s)
{
    static const char *const functions[] = {"prepare", "closures", "motion", "changes", "show", "along"};
    listed lists[LISTS];
    const struct kmp_simulated *x = s->simulated;
    kmp_text_printf(text, "const kempe_equations %s_equations = {\n    .name = ", s->name);
    kmp_language_string(text, &kmp_language_c, s->title);
    kmp_text_printf(text, ",\n    .hash = \"%s\",\n    .coordinates = %d,\n    .rows = %d,\n    .freedom = %d,\n",
                    s->hash, s->n, s->m, x->freedom);
    kmp_text_printf(
        text, "    .inputs = %d,\n    .parameters = %d,\n    .conditions = %d,\n    .outputs = %d,\n    .kept = %d,\n",
        s->input_count, s->parameter_count, x->condition_count, s->output_count, place_in_k(s, NULL));
    put_number(text, "rank_tolerance", x->rank_tolerance);
    kmp_text_printf(text, "    .early = %d,\n    .switches = %d,\n", x->early, x->switches);
    const double longest = kmp_time_scales_shortest(s->model);
    if (longest > 0)
        put_number(text, "longest", longest);
    if (x->loaded)
        kmp_text_put(text, "    .loads = loads,\n");
    if (x->slopes_count > 0)
        kmp_text_printf(text, "    .slopes_count = %d,\n    .slopes = slopes,\n", x->slopes_count);
    kmp_text_printf(text,
                    "    .start = {start_q, start_qd, independent, %s, start_given, start_keeps},\n"
                    "    .discrete = {%d, discrete_place, discrete_period, discrete_condition, discrete_sense,\n"
                    "        discrete_settles, next},\n",
                    x->starts ? "start" : "0", s->discrete_count);
    if (x->friction_count > 0)
        kmp_text_put(text, "    .friction = &friction,\n");
    if (x->chart_count > 0)
        kmp_text_put(text, "    .charts = &charts,\n");
    if (x->watch)
        kmp_text_put(text, "    .watch = &watch,\n");
    find_lists(s, lists);
    for (int k = 0; k < LISTS; k++)
        kmp_text_printf(text, "    .%s = %s,\n", lists[k].name, lists[k].name);
    for (size_t k = 0; k < sizeof functions / sizeof *functions; k++)
        kmp_text_printf(text, "    .%s = %s,\n", functions[k], functions[k]);
    kmp_text_put(text, "};\n");
}

static void put_header(kmp_text *text, const kmp_code_source *s)
{
    const struct kmp_simulated *x = s->simulated;
    const char *name = s->name;
    kmp_text_printf(text,
                    "/* Simulator of the model %s, written by Kempe " KEMPE_VERSION
                    ". The interface: kempe_simulator.h */\n"
                    "#ifndef KEMPE_%s_SIMULATOR_H\n#define KEMPE_%s_SIMULATOR_H\n\n#include \"kempe_simulator.h\"\n\n"
                    "#ifdef __cplusplus\nextern \"C\" {\n#endif\n\n/** Doubles in the memory of a simulator. */\n",
                    s->hash, name, name);
    kmp_text_printf(text, "enum { %s_memory = KEMPE_SIMULATOR_MEMORY(%d, %d, %d, %d, %d, %d, %d, %d, %d)", name, s->n,
                    s->m, x->freedom, s->input_count, s->parameter_count, place_in_k(s, NULL), x->condition_count,
                    s->output_count, s->discrete_count);
    if (x->friction_count > 0)
        kmp_text_printf(text, " +\n    KEMPE_SIMULATOR_FRICTION(%d, %d, %d, %d, %d)", s->n, s->m, x->freedom,
                        x->condition_count, x->friction_count);
    if (x->friction.contacts > 0)
        kmp_text_printf(text, " +\n    KEMPE_SIMULATOR_CONTACTS(%d, %d)", s->n, x->friction_count);
    if (x->chart_count > 0)
        kmp_text_printf(text, " +\n    KEMPE_SIMULATOR_CHARTS(%d, %d)", s->n, x->chart_count);
    if (x->watch) {
        kmp_text_put(text, " +\n    KEMPE_SIMULATOR_WATCH(");
        /* The arguments of KEMPE_SIMULATOR_WATCH. */
        const kmp_bound_code *code = &x->watch->code;
        kmp_text_printf(text, "%d, %d, %d, %d", x->condition_count, code->constants + code->inputs + code->steps,
                        code->inputs, x->watch_solved);
        kmp_text_put(text, ")");
    }
    kmp_text_put(text, " };\n\n");
    kmp_text_printf(text, "extern const kempe_equations %s_equations;\n\n#ifdef __cplusplus\n}\n#endif\n#endif\n",
                    name);
}

/* Routines of slopes, with their choices as a list. */
static void put_slopes(kmp_text *text, const kmp_code_source *s)
{
    const struct kmp_simulated *x = s->simulated;
    char name[KMP_CHOICE_NAME];
    for (int k = 0; k < x->slopes_count; k++) {
        snprintf(name, sizeof name, "slopes%d", k + 1);
        put_function(text, s, name, "double *udd, double *vd, double *checks", "udd, vd, checks");
        snprintf(name, sizeof name, "independent%d", k + 1);
        put_ints(text, name, x->freedom, x->slopes[k].independent);
        snprintf(name, sizeof name, "dependent%d", k + 1);
        put_ints(text, name, s->n - x->freedom, x->slopes[k].dependent);
        snprintf(name, sizeof name, "rows%d", k + 1);
        put_ints(text, name, s->n - x->freedom, x->slopes[k].rows);
        kmp_text_put(text, "\n");
    }
    for (int k = 0; k < x->slopes_count; k++)
        kmp_text_printf(text, "%s{independent%d, dependent%d, rows%d, slopes%d}%s",
                        k ? ", " : "static const kempe_slopes slopes[] = {", k + 1, k + 1, k + 1, k + 1,
                        k + 1 < x->slopes_count ? "" : "};\n\n");
}

static void put_source(kmp_text *text, const kmp_code_source *s)
{
    kmp_text_printf(
        text,
        "/* Simulator of the model %s, written by Kempe " KEMPE_VERSION ".\n *\n"
        " * To compile: cc -std=c99 -O2 -ffp-contract=off -c %s_simulator.c %s.c kempe_simulator.c%s%s%s (libm "
        "to link). */\n"
        "#include \"%s_simulator.h\"\n#include \"%s.h\"\n#include <math.h>\n#include <stddef.h>\n\n",
        s->hash, s->name, s->name, s->simulated->friction_count ? " kempe_friction.c" : "",
        s->simulated->chart_count ? " kempe_charts.c" : "", s->simulated->watch ? " kempe_events.c" : "", s->name,
        s->name);
    listed lists[LISTS];
    find_lists(s, lists);
    for (int k = 0; k < LISTS; k++)
        lists[k].put(text, lists[k].name, lists[k].count, lists[k].list);
    put_start(text, s);
    put_discrete(text, s);
    put_ints(text, "symbol", s->parameter_count, s->simulated->symbol);
    kmp_text_put(text, "\nstatic void prepare(const double *p, double *k)\n{\n");
    for (int k = 0; k < s->count; k++)
        kmp_text_printf(text, "    %s_%s_prepare(p, k + %d);\n", s->name, s->routines[k].name,
                        place_in_k(s, s->routines[k].name));
    kmp_text_put(text, "}\n\n");
    put_function(text, s, "closures", "double *h, double *J, double *h_t", "h, J, h_t");
    put_function(text, s, "motion", "double *M, double *C, double *jdqd", "M, C, jdqd");
    if (s->simulated->loaded)
        put_function(text, s, "loads", "double *slopes", "slopes");
    put_slopes(text, s);
    if (s->simulated->starts)
        put_function(text, s, "start", "double *values", "values");
    put_function(text, s, "show", "double *y", "y");
    put_changes(text, s);
    put_function(text, s, "next", "double *value", "value");
    put_along(text, s);
    put_friction(text, s);
    put_charts(text, s);
    put_watch(text, s);
    put_equations(text, s);
}

bool kmp_simulator_pages(const kmp_code_source *s, kmp_code_files *files)
{
    kmp_text *header = kmp_code_add(files, "%s_simulator.h", s->name);
    if (header)
        put_header(header, s);
    kmp_text *source = header ? kmp_code_add(files, "%s_simulator.c", s->name) : NULL;
    if (source)
        put_source(source, s);
    bool ok = source;
    const bool needed[] = {true, true, s->simulated->friction_count > 0, s->simulated->chart_count > 0,
                           s->simulated->watch != NULL};
    for (int k = 0; ok && k < (int)(sizeof needed / sizeof *needed); k++) {
        const kmp_runtime_file file = (kmp_runtime_file)(KMP_RUNTIME_SIMULATOR_HEADER + k);
        kmp_text *text = needed[k] ? kmp_code_add(files, "%s", kmp_runtime_name(file)) : NULL;
        if (text)
            kmp_runtime_put(text, file);
        ok = text || !needed[k];
    }
    return ok;
}
