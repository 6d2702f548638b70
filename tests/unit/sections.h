/* SPDX-License-Identifier: BSD-3-Clause */
/* The cross-section of a track for a point with coordinates q, as numbers, and its derivatives by them. */
#ifndef KEMPE_TESTS_SECTIONS_H
#define KEMPE_TESTS_SECTIONS_H

#include "backend/machine.h"
#include "model/data/wheels.h"
#include "rail/wheel/patch.h"
#include "symbolic/derivative.h"
#include "symbolic/table_function.h"
#include "testing.h"
#include <kempe/kempe.h>
#include <stdbool.h>

enum { ALONG = 0, ORIGIN = 1, AXES = 4, OUTWARDS = 13, UPWARDS = 15, VALUES = 17 };

typedef struct section {
    kmp_graph *graph;
    kmp_tree tree;
    kmp_program *program;
    kmp_machine *machine;
    const double *value, *slope; /* VALUES, and three times as many */
} section;

static inline void list_place(const kmp_track_place *place, kmp_ref list[VALUES])
{
    list[ALONG] = place->along;
    for (int k = 0; k < 3; k++) {
        list[ORIGIN + k] = place->origin.x[k];
        for (int i = 0; i < 3; i++)
            list[AXES + 3 * i + k] = place->axis[i].x[k];
    }
    for (int side = 0; side < 2; side++) {
        list[OUTWARDS + side] = place->outwards[side];
        list[UPWARDS + side] = place->upwards[side];
    }
}

static inline bool section_init(section *s, const kempe_model *model, const kmp_track *track)
{
    kmp_track_place place, again;
    kmp_vec p;
    kmp_ref list[4 * VALUES], twice[VALUES];
    const kmp_ref *lists[2] = {list, list + VALUES};
    int count[2] = {VALUES, 3 * VALUES};
    *s = (section){.graph = kmp_graph_new()};
    CHECK(kmp_tree_init(&s->tree, s->graph, model, KMP_KEEP_NOTHING, false));
    for (unsigned k = 0; k < 3; k++)
        p.x[k] = kmp_input(s->graph, KMP_IN_Q, k);
    kmp_track_at(&s->tree, track, p, &place);
    kmp_track_at(&s->tree, track, p, &again);
    CHECK(!kmp_graph_failed(s->graph));
    list_place(&place, list);
    list_place(&again, twice);
    CHECK(memcmp(list, twice, sizeof twice) == 0); /* nothing is solved twice */
    CHECK(kmp_graph_table(s->graph, kmp_graph_add_table(s->graph, track->rail)) != NULL);
    for (int k = 0; k < 3; k++) {
        kmp_ref one = KMP_ONE;
        kmp_derivative *d = kmp_derivative_new(s->graph, 1, &p.x[k], &one);
        for (int i = 0; i < VALUES; i++)
            list[(1 + k) * VALUES + i] = kmp_derivative_of(d, list[i]);
        kmp_derivative_free(d);
    }
    s->program = kmp_program_new(s->graph, 2, count, lists);
    s->machine = s->program ? kmp_machine_new(s->program, kmp_backend_find("tape")) : NULL;
    CHECK(s->machine != NULL);
    if (s->machine)
        (void)kmp_machine_run(s->machine, 0);
    return s->machine;
}

static inline void section_at(section *s, const double point[3])
{
    kmp_machine_set(s->machine, KMP_IN_Q, point);
    s->value = kmp_machine_run(s->machine, 1);
    s->slope = kmp_machine_run(s->machine, 2);
}

static inline void section_free(section *s)
{
    kmp_machine_free(s->machine);
    kmp_program_free(s->program);
    kmp_tree_free(&s->tree);
    kmp_graph_free(s->graph);
}

#endif
