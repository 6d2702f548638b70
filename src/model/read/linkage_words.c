/* SPDX-License-Identifier: BSD-3-Clause */
/* Messages about the choice of the tree. */
#include "model/read/linkage.h"

const char *kmp_edge_what(kmp_reader *r, const kmp_edge *edge)
{
    return edge->own ? kmp_reader_say(r, "the joint of body '%s'", edge->key->text)
                     : kmp_reader_say(r, "joint '%s'", edge->name);
}

const char *kmp_edge_name_reason(kmp_reader *r, const kmp_edge *edge)
{
    const char *reason = edge->need ? edge->need : "";
    if (edge->own)
        reason = kmp_reader_say(r, "it is defined in body '%s'", edge->key->text);
    else if (edge->wish == KMP_CUT_NO)
        reason = "cut: no";
    else if (!edge->cut)
        reason = kmp_reader_say(r, "a %s cannot be cut", edge->kind ? edge->kind->name : "joint of motions");
    return kmp_reader_say(r, "%s (%s)", edge->name, reason);
}

const char *kmp_linkage_bodies(kmp_reader *r, const kmp_linkage *g, int from, int count)
{
    const char *names = g->body_names[from];
    for (int k = 0; k < count; k++) {
        from = kmp_edge_far_end(&g->edges[g->path[k]], from);
        names = kmp_reader_say(r, "%s - %s", names, g->body_names[from]);
    }
    return names;
}

/* Relations of the joints that could be cut as well, or not, to the one that is cut. */
enum { MORE, STARTED, NEARER, BEFORE, STAYING, RELATIONS };

static int reach_of_cut(const kmp_linkage *g, const kmp_edge *cut)
{
    int a = g->depth[cut->body[0]], b = g->depth[cut->body[1]];
    return (a < b ? a : b) + cut->freedoms;
}

static int relation_of(const kmp_linkage *g, const kmp_edge *cut, const kmp_edge *edge)
{
    if (edge->stays)
        return STAYING;
    if (edge->cut->rows > cut->cut->rows)
        return MORE;
    if (edge->start && !cut->start)
        return STARTED;
    return g->depth[edge->body[edge->reversed ? 0 : 1]] < reach_of_cut(g, cut) ? NEARER : BEFORE;
}

const char *kmp_linkage_why(kmp_reader *r, kmp_linkage *g, const kmp_edge *cut)
{
    static const char *const words[RELATIONS] = {"it has fewer rows than", "it has no start value, unlike",
                                                 "it is farther from the ground than", "it comes after",
                                                 "not to be cut:"};
    const char *names[RELATIONS] = {NULL};
    kmp_text text = {0};
    if (cut->wish == KMP_CUT_YES)
        return "the model prescribes it (cut: yes)";
    if (cut->requested)
        return kmp_reader_say(r, "%s needs its reaction", cut->requested);
    int count = kmp_linkage_path(g, cut->body[0], cut->body[1]);
    for (int k = 0; k < count; k++) {
        const kmp_edge *edge = &g->edges[g->path[k]];
        int relation = relation_of(g, cut, edge);
        const char *name = relation == STAYING ? kmp_edge_name_reason(r, edge) : edge->name;
        names[relation] = names[relation] ? kmp_reader_say(r, "%s, %s", names[relation], name) : name;
    }
    for (int k = 0; k < RELATIONS; k++)
        if (names[k])
            kmp_text_printf(&text, "%s%s %s",
                            text.length > 0 ? "; "
                            : k == STAYING  ? "the others of its loop are "
                                            : "",
                            words[k], names[k]);
    return kmp_reader_take(r, &text);
}
