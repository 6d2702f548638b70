/* SPDX-License-Identifier: BSD-3-Clause */
/* Ports of an included file: names of parts of the including model, which it binds where it includes the file. */
#pragma once

#include "model/read/reading.h"

/** Reads the ports that the file of an instance declares and the ones that its include `node` binds, and replaces the
 * scalars and keys `port.NAME` of its root by what they are bound to, which keep their own place and file. Copy `copy`
 * of `copies` takes its item of a list. False after an error. */
bool kmp_bind_ports(kmp_reader *r, const kmp_yaml *node, kmp_include_instance *instance, int copy, int copies);

/** Gives the node that `port.NAME`, with which a name in a file begins, is bound to; NULL: the name has no port.
 * `*rest`: what follows, such as ".2" of a coordinate. */
const kmp_yaml *kmp_port_bound(const kmp_reader *r, int file, const char *name, const char **rest);

/** Reports ports that are bound to what is not of their kind. After all parts of the model are read. */
void kmp_check_ports(kmp_reader *r);

/** True, and reported, where the model itself has ports, which nothing binds: nothing more of it is read. */
bool kmp_refuse_ports(kmp_reader *r);
