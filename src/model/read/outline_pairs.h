/* SPDX-License-Identifier: BSD-3-Clause */
/* A contact with outlines: circles of one side and pieces of the other, each pair of which is a separate contact. */
#pragma once

#include "model/data/outline.h"
#include "model/read/reading.h"

/** A circle, or the circle of the contact itself, and what it meets. */
typedef struct kmp_outline_pair {
    bool swapped;           /* the circle belongs to the second side */
    bool off;               /* the circle has its own centre and radius: */
    double at[2], radius;   /* in the axes of its side's point */
    kmp_outline_part *part; /* of the other side; NULL: it is a plane */
} kmp_outline_pair;

/** A bound on their number in the contact of a mapping; 0: it has no outline. */
int kmp_outline_most_pairs(const kmp_reader *r, const kmp_yaml *map);

/** The pairs of the contact, in the scratch memory; its outlines have been read. -1 after an error. */
int kmp_outline_pairs(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_outline_pair **pairs);

/** The outlines of both sides of a contact that has been read; NULL: none. */
void kmp_outline_contact_outlines(const kmp_reader *r, const kmp_yaml *map, const kmp_outline *outline[2]);

/** Puts the pair into a contact whose sides have been read, and checks that their motion is plane. */
bool kmp_outline_pair_put(kmp_reader *r, const kmp_yaml *map, const char *what, const kmp_outline_pair *pair,
                          kmp_contact_pair *touch);

/** Reports circles that are deeper in a closed outline at the start than contacts can detect. Models with loops, whose
 * start is assembled, are not looked at. */
void kmp_settle_outlines(kmp_reader *r);
