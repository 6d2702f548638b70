/* SPDX-License-Identifier: BSD-3-Clause */
/* Conditions of elements: the same one in every graph, an input during steps and a comparison elsewhere. */
#include "check.h"
#include "dynamics/equations.h"
#include "loaded.h"

/* A graph of the model with its events, as programs are derived from. */
static kmp_equations derive(const loaded *s, kmp_events *events)
{
    kmp_equations eq;
    const kmp_scene scene = {.sets = KMP_SET_BIAS, .events = events};
    CHECK(kmp_equations_derive(&eq, s->model, &scene) == KEMPE_OK);
    return eq;
}

static kmp_ref coordinate(const kmp_equations *eq, int k)
{
    return kmp_input(eq->graph, KMP_IN_Q, (uint32_t)k);
}

static kmp_ref ask(const kmp_equations *eq, const void *of, int number, kmp_ref difference)
{
    return kmp_tree_condition(&eq->tree, of, number, difference, "stop '%s': contact %d", "S", number + 1);
}

static void each_graph_has_the_same(void)
{
    loaded s = load("tests/models/bounce.yaml");
    kmp_events events = {0};
    kmp_equations a = derive(&s, &events), b = derive(&s, &events);
    const kmp_force *force = &s.model->forces[0];
    kmp_ref one = KMP_ONE, difference;
    int first = events.count; /* the model's own condition */
    CHECK(first == 1);
    kmp_ref x = ask(&a, force, 0, coordinate(&a, 0)), y = ask(&a, force, 1, kmp_add(a.graph, coordinate(&a, 0), one));
    CHECK(x == kmp_input(a.graph, KMP_IN_MODE, (uint32_t)first));
    CHECK(y == kmp_input(a.graph, KMP_IN_MODE, (uint32_t)first + 1));
    CHECK(ask(&a, force, 0, coordinate(&a, 0)) == x && events.count == first + 2);
    CHECK(ask(&a, s.model, 0, coordinate(&a, 0)) != x && events.count == first + 3);
    CHECK(strcmp(events.condition[first + 1].text, "stop 'S': contact 2") == 0);
    CHECK(!kmp_tree_event(&b.tree, first, &difference));
    CHECK(ask(&b, force, 1, kmp_neg(coordinate(&b, 0))) == kmp_input(b.graph, KMP_IN_MODE, (uint32_t)first + 1));
    CHECK(kmp_tree_event(&b.tree, first + 1, &difference) && difference == kmp_neg(coordinate(&b, 0)));
    CHECK(!kmp_tree_event(&b.tree, first, &difference));
    CHECK(kmp_tree_event(&a.tree, first, &difference) && difference == coordinate(&a, 0));
    CHECK(kmp_tree_event(&a.tree, 0, &difference)); /* an expression's is derived anywhere */
    CHECK(kmp_tree_event(&b.tree, 0, &difference));
    kmp_equations_free(&a);
    kmp_equations_free(&b);
    kmp_events_free(&events);
    unload(&s);
}

static void what_stands_still_is_compared(void)
{
    loaded s = load("tests/models/bounce.yaml");
    kmp_events events = {0};
    kmp_equations a = derive(&s, &events), b = derive(&s, NULL);
    int count = events.count;
    CHECK(ask(&a, &s, 0, KMP_ONE) == KMP_ZERO && ask(&a, &s, 1, kmp_neg(KMP_ONE)) == KMP_ONE);
    CHECK(events.count == count);
    kmp_ref q = coordinate(&b, 0);
    CHECK(ask(&b, &s, 0, q) == kmp_less(b.graph, q, KMP_ZERO));
    kmp_equations_free(&a);
    kmp_equations_free(&b);
    kmp_events_free(&events);
    unload(&s);
}

int main(void)
{
    TEST(each_graph_has_the_same);
    TEST(what_stands_still_is_compared);
    return check_report();
}
