/* SPDX-License-Identifier: BSD-3-Clause */
#include "generate/sets.h"
#include "base/memory.h"
#include <string.h>

static const struct {
    const char *name;
    unsigned sets;
} groups[] = {
#define KMP_EQUATIONS(id, name, derive, rows, columns, lower, entries, inputs, array, meaning)
#define KMP_GROUP(name, members) {name, members},
#include "generate/sets.def"
#undef KMP_EQUATIONS
#undef KMP_GROUP
};

enum { GROUPS = sizeof groups / sizeof *groups };

kmp_set kmp_set_of(const kmp_equations *eq, int set)
{
    enum {
        QD = 1 << KMP_IN_QD,
        QDD = 1 << KMP_IN_QDD,
        LAMBDA = 1 << KMP_IN_LAMBDA,
        MODES = 1 << KMP_IN_MODE,
        ALONG = 1 << KMP_IN_ALONG
    };
    enum { LOADS = 1 << KMP_IN_FORCE | 1 << KMP_IN_TORQUE };
    static const kmp_equations none;
    const kmp_equations *of = eq ? eq : &none;
    const int n = of->n, m = of->m, w = of->shown_count, f = of->friction_count, d = of->next_count;
    const int c = of->contact_count, e = of->delayed_count, g = of->watched_count, s = of->along_count;
    const kmp_set sets[] = {
#define KMP_EQUATIONS(id, name, derive, rows, columns, lower, entries, inputs, array, meaning)                         \
    {name, derive, rows, columns, lower, of->entries, inputs, array, meaning},
#define KMP_GROUP(name, members)
#include "generate/sets.def"
#undef KMP_EQUATIONS
#undef KMP_GROUP
    };
    return sets[set];
}

int kmp_set_size(const kmp_set *set)
{
    return set->lower ? set->rows * (set->rows + 1) / 2 : set->rows * (set->columns ? set->columns : 1);
}

/* -- names ------------------------------------------------------------------------------------------- */

static bool is_called(const char *own, const char *name, size_t length)
{
    return strlen(own) == length && strncmp(own, name, length) == 0;
}

unsigned kmp_sets_find(const char *name, size_t length)
{
    for (int k = 0; k < GROUPS; k++)
        if (is_called(groups[k].name, name, length))
            return groups[k].sets;
    for (int k = 0; k < KMP_EQ_LOADS; k++)
        if (is_called(kmp_set_of(NULL, k).name, name, length))
            return 1u << k;
    return 0;
}

void kmp_sets_list(kmp_text *text)
{
    for (int k = 0; k < GROUPS; k++)
        kmp_text_printf(text, "%s%s", k ? ", " : "", groups[k].name);
    for (int k = 0; k < KMP_EQ_LOADS; k++)
        kmp_text_printf(text, ", %s", kmp_set_of(NULL, k).name);
}

unsigned kmp_sets_derive(unsigned wanted)
{
    unsigned derive = 0;
    for (int k = 0; k < KMP_EQ_SETS; k++)
        derive |= wanted & 1u << k ? kmp_set_of(NULL, k).derive : 0;
    return derive;
}

/* -- entries ----------------------------------------------------------------------------------------- */

static void put_set(kmp_assignment *a, const kmp_set *set)
{
    for (int i = 0; i < set->rows; i++)
        if (set->columns)
            for (int k = 0; k < (set->lower ? i + 1 : set->columns); k++)
                *a++ = (kmp_assignment){set->name, i, k, set->entries[i * set->columns + k]};
        else
            *a++ = (kmp_assignment){set->name, i, -1, set->entries[i]};
}

int kmp_sets_size(const kmp_equations *eq, unsigned wanted)
{
    int size = 0;
    for (int k = 0; k < KMP_EQ_SETS; k++) {
        kmp_set set = kmp_set_of(eq, k);
        size += wanted & 1u << k ? kmp_set_size(&set) : 0;
    }
    return size;
}

void kmp_sets_put(const kmp_equations *eq, unsigned wanted, kmp_assignment *entries)
{
    for (int k = 0; k < KMP_EQ_SETS; k++) {
        kmp_set set = kmp_set_of(eq, k);
        if (!(wanted & 1u << k))
            continue;
        put_set(entries, &set);
        entries += kmp_set_size(&set);
    }
}

kmp_ref *kmp_sets_outputs(const kmp_equations *eq, unsigned wanted)
{
    int count = kmp_sets_size(eq, wanted);
    kmp_assignment *entries = KMP_NEW(kmp_assignment, count);
    kmp_ref *outputs = entries ? KMP_NEW(kmp_ref, count) : NULL;
    if (outputs)
        kmp_sets_put(eq, wanted, entries);
    for (int k = 0; outputs && k < count; k++)
        outputs[k] = entries[k].value;
    kmp_free(entries);
    return outputs;
}

kmp_program *kmp_sets_program(const kmp_equations *eq, unsigned wanted)
{
    int count = kmp_sets_size(eq, wanted);
    kmp_ref *outputs = kmp_sets_outputs(eq, wanted);
    kmp_program *program = NULL;
    if (outputs && kmp_equations_shorten(eq, count, outputs))
        program = kmp_program_of_parameters(eq->graph, count, outputs);
    kmp_free(outputs);
    return program;
}

/* -- counts ------------------------------------------------------------------------------------------ */

kmp_tally kmp_tally_program(const kmp_program *p, int first, int last)
{
    return (kmp_tally){.counts = kmp_program_count(p, first, last),
                       .runtime = kmp_program_count(p, first > 0 ? first : 1, last),
                       .created = (long)p->graph_nodes,
                       .kept = (long)p->constant_count + p->input_count + p->code[p->stages],
                       .operations = p->code[last + 1] - p->code[first]};
}

kempe_status kmp_tally_sets(const kempe_model *model, const kmp_scene *scene, unsigned wanted, kmp_tally *tally)
{
    kmp_equations eq;
    kmp_scene alone = *scene;
    alone.sets = kmp_sets_derive(wanted);
    KMP_TRY(kmp_equations_derive(&eq, model, &alone));
    kmp_program *program = kmp_sets_program(&eq, wanted);
    kmp_steps steps = {.vector = -1};
    if (program)
        steps = kmp_program_steps(program);
    bool ok = steps.vector >= 0;
    if (ok) {
        *tally = kmp_tally_program(program, 0, 1);
        long count = 0;
        for (uint32_t id = 0; id < kmp_graph_count(eq.graph); id++)
            count += kmp_op_arity((kmp_op)kmp_graph_node(eq.graph, id)->op) > 0;
        tally->useless = count - tally->operations;
        tally->steps = steps;
    }
    kmp_program_free(program);
    kmp_equations_free(&eq);
    return ok ? KEMPE_OK : kmp_fail_memory(model->context);
}
