/* SPDX-License-Identifier: BSD-3-Clause */
#include "generate/banner.h"
#include <string.h>

const char *const kmp_argument_names[KMP_IN_COUNT] = {
    [KMP_IN_PARAMETER] = "k", [KMP_IN_TIME] = "t",         [KMP_IN_Q] = "q",         [KMP_IN_QD] = "qd",
    [KMP_IN_QDD] = "qdd",     [KMP_IN_LAMBDA] = "lambda_", [KMP_IN_FORCE] = "force", [KMP_IN_TORQUE] = "torque"};

/* A name in a comment: characters that would end the comment are removed. */
static void put_name(kmp_text *text, const char *name)
{
    for (; *name; name++)
        kmp_text_printf(text, "%c", (unsigned char)*name < 0x20 || *name == '*' ? ' ' : *name);
}

/* "q: 0 crank (rad) 1 ..": a few a line. */
static void put_names(kmp_text *text, const kmp_code_source *source, const char *mark, int base, bool rows)
{
    const kempe_model *model = source->model;
    int count = rows ? source->m : source->n;
    for (int k = 0; k < count; k++) {
        if (k % 6 == 0)
            kmp_text_printf(text, "%s%s %s", k ? "\n" : "", mark, k ? "  " : rows ? "h:" : "q:");
        kmp_text_printf(text, " %d ", k + base);
        put_name(text, rows ? source->row_names[k] : model->motions[k].name);
        if (!rows)
            kmp_text_put(text, model->motions[k].rotation ? " (rad)" : " (m)");
    }
    kmp_text_put(text, count ? "\n" : "");
}

void kmp_banner_put(kmp_text *text, const kmp_code_source *source, const char *mark, int base)
{
    kmp_text_printf(text, "%s Equations of '", mark);
    put_name(text, source->title);
    kmp_text_printf(text, "', written by Kempe " KEMPE_VERSION "\n");
    kmp_text_printf(text, "%s model %s, M by scheme %s, numbers %s%s\n%s\n", mark, source->hash, source->scheme,
                    source->parameters ? "kept as parameters" : "folded", source->inputs ? ", inputs on bodies" : "",
                    mark);
    kmp_text_printf(text, "%s M qdd + C = J' lambda, Q = M qdd + C, h = 0, J = dh/dq, J qdd + jdqd = 0; SI units\n",
                    mark);
    kmp_text_printf(text, "%s operations (+ - * /; with signs and functions; of these for the parameters):\n", mark);
    for (int k = 0; k < source->count; k++) {
        const kmp_tally *t = &source->routines[k].tally;
        kmp_text_printf(text, "%s   %s: %ld; %ld; %ld\n", mark, source->routines[k].name, t->counts.paper,
                        t->counts.robotran, t->counts.robotran - t->runtime.robotran);
    }
    kmp_text_printf(text, "%s\n", mark);
    put_names(text, source, mark, base, false);
    put_names(text, source, mark, base, true);
}

static void put_array(kmp_text *text, const kmp_array *a, const char *mark)
{
    static const struct {
        const char *name, *meaning;
    } meanings[] = {{"M", "mass matrix"},
                    {"C", "M qdd + C are the efforts of the joints; forces of the model included"},
                    {"Q", "efforts that give qdd"},
                    {"Q_q", "their derivatives by q"},
                    {"Q_qd", "their derivatives by qd; by qdd: M"},
                    {"R", "Q - J' lambda"},
                    {"R_q", "its derivatives by q; by qd: Q_qd, by qdd: M, by lambda: -J'"},
                    {"acc", "accelerations without closure forces"},
                    {"h", "closures"},
                    {"J", "their derivatives by q"},
                    {"h_t", "their derivatives by t: the closures' rates are J qd + h_t"},
                    {"jdqd", "their second time derivatives at qdd = 0"}};
    kmp_text_printf(text, "%s %s: %d", mark, a->name, a->rows);
    if (a->cols)
        kmp_text_printf(text, " x %d", a->cols);
    for (size_t k = 0; k < sizeof meanings / sizeof *meanings; k++)
        if (strcmp(meanings[k].name, a->name) == 0)
            kmp_text_printf(text, ", %s\n", meanings[k].meaning);
}

void kmp_banner_routine(kmp_text *text, const kmp_code_source *source, const kmp_routine *r, const char *mark)
{
    if (source->parameters)
        kmp_text_printf(text, "%s k: %d, by prepare\n", mark, r->kept_count);
    kmp_text_printf(text, "%s t: s; q", mark);
    if (r->arguments & 1u << KMP_IN_QD)
        kmp_text_put(text, ", qd");
    if (r->arguments & 1u << KMP_IN_QDD)
        kmp_text_put(text, ", qdd");
    kmp_text_printf(text, ": %d\n", source->n);
    if (r->arguments & 1u << KMP_IN_LAMBDA)
        kmp_text_printf(text, "%s lambda_: %d, multipliers of h\n", mark, source->m);
    if (r->arguments & 1u << KMP_IN_FORCE)
        kmp_text_printf(text, "%s force, torque: three a body of %d, at its centre of mass, its axes\n", mark,
                        source->body_count);
    for (int a = 0; a < r->array_count; a++)
        put_array(text, &r->arrays[a], mark);
}
