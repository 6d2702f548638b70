// SPDX-License-Identifier: BSD-3-Clause
// Common parts of the programs here: the text of a tree (tree.py), states, clocks.
#ifndef KEMPE_PEERS_TREE_H
#define KEMPE_PEERS_TREE_H

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

using Triple = std::array<double, 3>;

struct TreeMotion {
    bool turns;
    Triple axis;
};

struct TreeBody {
    std::string name;
    int parent;
    Triple at;
    double mass;
    Triple com;
    std::array<double, 6> inertia; // xx yy zz xy xz yz
    std::vector<TreeMotion> motions;
};

struct Pair {
    int a, b;
    Triple pa, pb;
    double stiffness, damping, length;
};

struct Held {
    int k;
    double stiffness, damping, rest;
};

struct Coupled {
    int a, b;
    double stiffness, damping;
};

struct Tree {
    Triple gravity{};
    std::vector<TreeBody> bodies;
    std::vector<Pair> closures, rods, springs;
    std::vector<std::pair<int, double>> efforts;
    std::vector<Held> held; // springs in joints
    std::vector<Coupled> coupled;
    std::vector<double> q, qd;
    int n = 0;
};

inline Triple triple(std::istream &in)
{
    Triple x{};
    in >> x[0] >> x[1] >> x[2];
    return x;
}

inline Tree read_tree(const char *path)
{
    Tree tree;
    std::ifstream file(path);
    std::string line, word;
    while (std::getline(file, line)) {
        std::istringstream in(line);
        in >> word;
        if (word == "gravity")
            tree.gravity = triple(in);
        else if (word == "body") {
            TreeBody b;
            int count;
            in >> b.name >> b.parent;
            b.at = triple(in);
            in >> b.mass;
            b.com = triple(in);
            for (double &x : b.inertia)
                in >> x;
            in >> count;
            for (int k = 0; k < count; k++) {
                std::string kind;
                in >> kind;
                b.motions.push_back({kind == "R", triple(in)});
            }
            tree.n += count;
            tree.bodies.push_back(b);
        } else if (word == "closure" || word == "spring") {
            Pair p{};
            in >> p.a;
            p.pa = triple(in);
            in >> p.b;
            p.pb = triple(in);
            in >> p.stiffness >> p.damping >> p.length;
            (word == "spring" ? tree.springs : tree.closures).push_back(p);
        } else if (word == "effort") {
            int k;
            double x;
            in >> k >> x;
            tree.efforts.emplace_back(k, x);
        } else if (word == "rod") {
            Pair p{};
            in >> p.a;
            p.pa = triple(in);
            in >> p.b;
            p.pb = triple(in);
            in >> p.length;
            tree.rods.push_back(p);
        } else if (word == "coupled") {
            Coupled s{};
            in >> s.a >> s.b >> s.stiffness >> s.damping;
            tree.coupled.push_back(s);
        } else if (word == "held") {
            Held s{};
            in >> s.k >> s.stiffness >> s.damping >> s.rest;
            tree.held.push_back(s);
        } else if (word == "start") {
            tree.q.resize(static_cast<size_t>(tree.n));
            tree.qd.resize(static_cast<size_t>(tree.n));
            for (double &x : tree.q)
                in >> x;
            for (double &x : tree.qd)
                in >> x;
        }
    }
    if (tree.bodies.empty()) {
        std::cerr << path << ": no tree\n";
        std::exit(2);
    }
    return tree;
}

// Every joint turns about z.
inline bool is_plane(const Tree &tree)
{
    for (const TreeBody &b : tree.bodies)
        for (const TreeMotion &m : b.motions)
            if (!m.turns || m.axis[0] != 0 || m.axis[1] != 0)
                return false;
    return true;
}

inline bool is_free(const TreeBody &b)
{
    if (b.parent >= 0 || b.motions.size() != 6)
        return false;
    for (int k = 0; k < 6; k++)
        for (int i = 0; i < 3; i++)
            if (b.motions[k].turns != (k >= 3) || b.motions[k].axis[i] != (i == k % 3))
                return false;
    return true;
}

struct State {
    std::vector<double> q, qd;
};

inline std::vector<State> read_states(const char *path, int n)
{
    std::vector<State> states;
    std::ifstream file(path);
    for (double x; file >> x;) {
        State s;
        s.q.push_back(x);
        for (int k = 1; k < 2 * n && file >> x; k++)
            (k < n ? s.q : s.qd).push_back(x);
        states.push_back(s);
    }
    return states;
}

inline double cpu_now()
{
    timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// Accelerations of all states, `skip` first ones left out, then ns a call: the median of 9 rounds.
template <class Evaluate>
void report(const char *name, const std::vector<State> &states, double seconds, int skip, Evaluate evaluate)
{
    std::vector<double> qdd;
    std::printf("%s\n", name);
    for (const State &s : states) {
        evaluate(s, qdd);
        for (size_t k = 0; k < qdd.size(); k++)
            std::printf(static_cast<int>(k) < skip ? "nan " : "%.17g ", qdd[k]);
        std::printf("\n");
    }
    long count = 1;
    double spent = 0;
    std::vector<double> ns;
    for (;; count *= 2) {
        double begin = cpu_now();
        for (long k = 0; k < count; k++)
            evaluate(states[static_cast<size_t>(k) % states.size()], qdd);
        spent = cpu_now() - begin;
        if (spent > seconds / 12)
            break;
    }
    for (int round = 0; round < 9; round++) {
        double begin = cpu_now();
        for (long k = 0; k < count; k++)
            evaluate(states[static_cast<size_t>(k) % states.size()], qdd);
        ns.push_back(1e9 * (cpu_now() - begin) / static_cast<double>(count));
    }
    std::sort(ns.begin(), ns.end());
    std::printf("%.6g\n", ns[4]);
}

#endif
