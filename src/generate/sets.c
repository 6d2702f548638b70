/* SPDX-License-Identifier: BSD-3-Clause */
#include "generate/sets.h"
#include "base/memory.h"
#include <string.h>

static const struct {
    const char *name;
    unsigned derive;
} sets[KMP_EQ_SETS] = {
#define KMP_EQUATIONS(id, name, derive) {name, derive},
#define KMP_GROUP(name, members)
#include "generate/sets.def"
#undef KMP_EQUATIONS
#undef KMP_GROUP
};

static const struct {
    const char *name;
    unsigned sets;
} groups[] = {
#define KMP_EQUATIONS(id, name, derive)
#define KMP_GROUP(name, members) {name, members},
#include "generate/sets.def"
#undef KMP_EQUATIONS
#undef KMP_GROUP
};

enum { GROUPS = sizeof groups / sizeof *groups };

/* -- names ------------------------------------------------------------------------------------------- */

const char *kmp_set_name(kmp_eq_set set)
{
    return sets[set].name;
}

static bool is_called(const char *own, const char *name, size_t length)
{
    return strlen(own) == length && strncmp(own, name, length) == 0;
}

unsigned kmp_sets_find(const char *name, size_t length)
{
    for (int k = 0; k < GROUPS; k++)
        if (is_called(groups[k].name, name, length))
            return groups[k].sets;
    for (int k = 0; k < KMP_EQ_SETS; k++)
        if (is_called(sets[k].name, name, length))
            return 1u << k;
    return 0;
}

void kmp_sets_list(kmp_text *text)
{
    for (int k = 0; k < GROUPS; k++)
        kmp_text_printf(text, "%s%s", k ? ", " : "", groups[k].name);
    for (int k = 0; k < KMP_EQ_SETS; k++)
        kmp_text_printf(text, ", %s", sets[k].name);
}

unsigned kmp_sets_derive(unsigned wanted)
{
    unsigned derive = 0;
    for (int k = 0; k < KMP_EQ_SETS; k++)
        derive |= wanted & 1u << k ? sets[k].derive : 0;
    return derive;
}

/* -- entries ----------------------------------------------------------------------------------------- */

static int set_size(const kmp_equations *eq, kmp_eq_set set)
{
    switch (set) {
    case KMP_EQ_M:
        return eq->n * (eq->n + 1) / 2;
    case KMP_EQ_C:
    case KMP_EQ_INVDYN:
    case KMP_EQ_QDD:
    case KMP_EQ_R:
        return eq->n;
    case KMP_EQ_INVDYN_Q:
    case KMP_EQ_INVDYN_QD:
    case KMP_EQ_R_Q:
        return eq->n * eq->n;
    case KMP_EQ_J:
        return eq->m * eq->n;
    case KMP_EQ_H:
    case KMP_EQ_H_T:
    case KMP_EQ_JDQD:
    case KMP_EQ_SETS:
        break;
    }
    return eq->m;
}

static void put_matrix(kmp_assignment *a, const char *name, int rows, int cols, bool lower, const kmp_ref *value)
{
    for (int i = 0; i < rows; i++)
        for (int k = 0; k < (lower ? i + 1 : cols); k++)
            *a++ = (kmp_assignment){name, i, k, value[i * cols + k]};
}

static void put_vector(kmp_assignment *a, const char *name, int count, const kmp_ref *value)
{
    for (int i = 0; i < count; i++)
        *a++ = (kmp_assignment){name, i, -1, value[i]};
}

static void put_set(kmp_assignment *a, const kmp_equations *eq, kmp_eq_set set)
{
    const char *name = set < KMP_EQ_SETS ? sets[set].name : "";
    switch (set) {
    case KMP_EQ_M:
        put_matrix(a, name, eq->n, eq->n, true, eq->mass);
        break;
    case KMP_EQ_C:
        put_vector(a, name, eq->n, eq->bias);
        break;
    case KMP_EQ_INVDYN:
        put_vector(a, name, eq->n, eq->inverse);
        break;
    case KMP_EQ_INVDYN_Q:
        put_matrix(a, name, eq->n, eq->n, false, eq->inverse_q);
        break;
    case KMP_EQ_INVDYN_QD:
        put_matrix(a, name, eq->n, eq->n, false, eq->inverse_qd);
        break;
    case KMP_EQ_R:
        put_vector(a, name, eq->n, eq->closed);
        break;
    case KMP_EQ_R_Q:
        put_matrix(a, name, eq->n, eq->n, false, eq->closed_q);
        break;
    case KMP_EQ_QDD:
        put_vector(a, name, eq->n, eq->free_qdd);
        break;
    case KMP_EQ_H:
        put_vector(a, name, eq->m, eq->h);
        break;
    case KMP_EQ_J:
        put_matrix(a, name, eq->m, eq->n, false, eq->jacobian);
        break;
    case KMP_EQ_H_T:
        put_vector(a, name, eq->m, eq->h_t);
        break;
    case KMP_EQ_JDQD:
        put_vector(a, name, eq->m, eq->jdqd);
        break;
    case KMP_EQ_SETS:
        break;
    }
}

int kmp_sets_size(const kmp_equations *eq, unsigned wanted)
{
    int size = 0;
    for (int k = 0; k < KMP_EQ_SETS; k++)
        size += wanted & 1u << k ? set_size(eq, (kmp_eq_set)k) : 0;
    return size;
}

void kmp_sets_put(const kmp_equations *eq, unsigned wanted, kmp_assignment *entries)
{
    for (int k = 0; k < KMP_EQ_SETS; k++)
        if (wanted & 1u << k) {
            put_set(entries, eq, (kmp_eq_set)k);
            entries += set_size(eq, (kmp_eq_set)k);
        }
}

kmp_program *kmp_sets_program(const kmp_equations *eq, unsigned wanted)
{
    int count = kmp_sets_size(eq, wanted);
    kmp_assignment *entries = KMP_NEW(kmp_assignment, count);
    kmp_ref *outputs = KMP_NEW(kmp_ref, count);
    kmp_program *program = NULL;
    if (entries && outputs) {
        kmp_sets_put(eq, wanted, entries);
        for (int k = 0; k < count; k++)
            outputs[k] = entries[k].value;
        if (kmp_equations_shorten(eq, count, outputs))
            program = kmp_program_new(eq->graph, 1, &count, (const kmp_ref *const *)&outputs);
    }
    kmp_free(entries);
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

static long count_operations(const kmp_graph *g)
{
    long count = 0;
    for (uint32_t id = 0; id < kmp_graph_count(g); id++)
        count += kmp_op_arity((kmp_op)kmp_graph_node(g, id)->op) > 0;
    return count;
}

kempe_status kmp_tally_sets(const kempe_model *model, const kmp_scene *scene, unsigned wanted, kmp_tally *tally)
{
    kmp_equations eq;
    kmp_scene alone = *scene;
    alone.sets = kmp_sets_derive(wanted);
    kempe_status status = kmp_equations_derive(&eq, model, &alone);
    if (status != KEMPE_OK)
        return status;
    kmp_program *program = kmp_sets_program(&eq, wanted);
    kmp_steps steps = {.vector = -1};
    if (program)
        steps = kmp_program_steps(program);
    if (steps.vector >= 0) {
        *tally = kmp_tally_program(program, 0, 1);
        tally->useless = count_operations(eq.graph) - tally->operations;
        tally->steps = steps;
    } else {
        status = kmp_fail_memory(model->context);
    }
    kmp_program_free(program);
    kmp_equations_free(&eq);
    return status;
}
