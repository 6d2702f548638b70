/* SPDX-License-Identifier: BSD-3-Clause */
/* The graph of bodies and joints: which joints make the tree, and which are cut. Body 0 is the ground. */
#pragma once

#include "model/data/joint_table.h"
#include "model/read/reading.h"

typedef enum kmp_cut_wish { KMP_CUT_CHOICE, KMP_CUT_YES, KMP_CUT_NO } kmp_cut_wish;

/** A joint between two bodies. Joints declared in a body must stay. */
typedef struct kmp_edge {
    const char *name; /* as the model has it */
    const kmp_yaml *key, *map;
    bool own;                 /* it is declared in its second body */
    int body[2];              /* the first and the second, as the joint's coordinates are counted */
    const kmp_yaml *point[2]; /* BODY.POINT; of an own joint `at` and `to`, which may be absent */
    bool off[2]; /* its body there is flexible, and cannot be carried by that point, which is not its origin */
    bool last;   /* it would carry one there: it is in the tree where nothing else connects the body */
    const kmp_joint_row *kind; /* NULL: unknown, or motions */
    const kmp_cut_row *cut;    /* NULL: it cannot be cut */
    int freedoms;
    kmp_cut_wish wish;
    const char *need;      /* why it must have a coordinate, NULL: it need not */
    bool stopped;          /* only for contacts: it stays where another joint of its loop can be cut */
    const char *requested; /* the expression of the machine that has its multipliers; NULL: none */
    const kmp_yaml *start; /* one of its start values */
    bool stays;            /* in the tree in any case (while choosing: joined to its group) */
    bool tree, reversed;   /* chosen: in the tree; its second body carries the first */
    bool faulty;           /* its error is reported: neither in the tree nor cut */
    const kmp_yaml *made;  /* the node that replaces it: a joint, or a closure */
} kmp_edge;

struct kmp_linkage {
    int body_count; /* ground included */
    const char **body_names;
    const kmp_yaml **body_keys, **body_maps; /* NULL for the ground */
    kmp_edge *edges;                         /* those declared in bodies first */
    int edge_count, own_count;
    kmp_name_index body_index, own_index, joint_index; /* of the bodies, of edges in bodies, of the others */
    const kmp_edge **made;                             /* edges with `made`, by its address */
    int made_count;
    int *first, *next;                   /* ends of edges at a body, 2 * edge + end; -1: no more */
    int *waiting, *reach, waiting_count; /* heap of edges that may be taken next, with the depth beyond them */
    bool broken;                         /* an edge could not be read: bodies without connection are not reported */
    int *by;                             /* edge by which a body is attached, -1 */
    int *depth;                          /* coordinates between the ground and a body */
    int *order;                          /* bodies in the order in which they were reached */
    int *group;                          /* bodies that staying joints connect */
    int *path;                           /* edges of the last path found */
    kmp_yaml cuts;                       /* the cut joints as a mapping of closures */
};

/** The joint of `joints` with a name; NULL: there is none. */
kmp_edge *kmp_linkage_joint_named(kmp_reader *r, kmp_linkage *g, const char *name);

/** "joint 'A'", or "the joint of body 'a'". */
const char *kmp_edge_what(kmp_reader *r, const kmp_edge *edge);

/** Chooses the tree: the joints that must stay, then joints whose cut has most rows, joints with a start value before
 * others, joints near the ground, the file's order. Reports impossible requests. */
void kmp_linkage_choose(kmp_reader *r, kmp_linkage *g);

/** The edges between two bodies in order, in the tree or, before it is chosen, among the staying joints: g->path;
 * returns their number. */
int kmp_linkage_path(kmp_linkage *g, int from, int to);

/** Why a joint is cut, in words. */
const char *kmp_linkage_why(kmp_reader *r, kmp_linkage *g, const kmp_edge *cut);

/** "ground, crank, rocker": the bodies of the path found from `from`. */
const char *kmp_linkage_bodies(kmp_reader *r, const kmp_linkage *g, int from, int count);

/** Sets need, asked and start of the edges from their uses elsewhere in the model. */
void kmp_linkage_find_uses(kmp_reader *r, kmp_linkage *g);

/** Words of expressions whose argument is a closure with its multipliers; NULL ends the list. */
extern const char *const kmp_words_of_loads[];
