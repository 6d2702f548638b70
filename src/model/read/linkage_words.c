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

/* Comparison of the cut joint with those of its loop that could be cut as well. */
typedef struct rivals {
    const char *more, *started, *nearer,
        *before;         /* names: of more rows, with a start value, nearer the ground, others */
    const char *staying; /* and those that stay, with their reasons */
} rivals;

static const char *add_name(kmp_reader *r, const char *names, const char *name)
{
    return names ? kmp_reader_say(r, "%s, %s", names, name) : name;
}

static int reach_of_cut(const kmp_linkage *g, const kmp_edge *cut)
{
    int a = g->depth[cut->body[0]], b = g->depth[cut->body[1]];
    return (a < b ? a : b) + cut->freedoms;
}

static int reach_of(const kmp_linkage *g, const kmp_edge *edge)
{
    return g->depth[edge->body[edge->reversed ? 0 : 1]];
}

static rivals compare(kmp_reader *r, kmp_linkage *g, const kmp_edge *cut)
{
    rivals of = {0};
    int count = kmp_linkage_path(g, cut->body[0], cut->body[1]);
    for (int k = 0; k < count; k++) {
        const kmp_edge *edge = &g->edges[g->path[k]];
        if (edge->stays)
            of.staying = add_name(r, of.staying, kmp_edge_name_reason(r, edge));
        else if (edge->cut->rows > cut->cut->rows)
            of.more = add_name(r, of.more, edge->name);
        else if (edge->start && !cut->start)
            of.started = add_name(r, of.started, edge->name);
        else if (reach_of(g, edge) < reach_of_cut(g, cut))
            of.nearer = add_name(r, of.nearer, edge->name);
        else
            of.before = add_name(r, of.before, edge->name);
    }
    return of;
}

static void put_clause(kmp_text *text, const char *names, const char *words)
{
    if (names)
        kmp_text_printf(text, "%s%s %s", text->length > 0 ? "; " : "", words, names);
}

const char *kmp_linkage_why(kmp_reader *r, kmp_linkage *g, const kmp_edge *cut)
{
    if (cut->wish == KMP_CUT_YES)
        return "the model prescribes it (cut: yes)";
    if (cut->asked)
        return kmp_reader_say(r, "output %s needs its reaction", cut->asked);
    rivals of = compare(r, g, cut);
    kmp_text text = {0};
    put_clause(&text, of.more, "it has fewer rows than");
    put_clause(&text, of.started, "it has no start value, unlike");
    put_clause(&text, of.nearer, "it is farther from the ground than");
    put_clause(&text, of.before, "it comes after");
    put_clause(&text, of.staying, text.length > 0 ? "not to be cut:" : "the others of its loop are not to be cut:");
    return kmp_reader_take(r, &text);
}
