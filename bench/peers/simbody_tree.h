// SPDX-License-Identifier: BSD-3-Clause
// A tree as a system of Simbody, with its springs, efforts and closures.
#ifndef KEMPE_PEERS_SIMBODY_TREE_H
#define KEMPE_PEERS_SIMBODY_TREE_H

#include "tree.h"
#include <Simbody.h>

// A spring between two coordinates.
struct SimbodyCoupling : SimTK::Force::Custom::Implementation {
    SimTK::MobilizedBody a, b;
    double stiffness, damping;

    SimbodyCoupling(SimTK::MobilizedBody first, SimTK::MobilizedBody second, const Coupled &given)
        : a(first), b(second), stiffness(given.stiffness), damping(given.damping)
    {
    }

    void calcForce(const SimTK::State &state, SimTK::Vector_<SimTK::SpatialVec> &, SimTK::Vector_<SimTK::Vec3> &,
                   SimTK::Vector &mobility) const override
    {
        double effort = stiffness * (b.getOneQ(state, 0) - a.getOneQ(state, 0)) +
                        damping * (b.getOneU(state, 0) - a.getOneU(state, 0));
        a.applyOneMobilityForce(state, 0, effort, mobility);
        b.applyOneMobilityForce(state, 0, -effort, mobility);
    }

    SimTK::Real calcPotentialEnergy(const SimTK::State &state) const override
    {
        double apart = b.getOneQ(state, 0) - a.getOneQ(state, 0);
        return 0.5 * stiffness * apart * apart;
    }
};

struct SimbodyTree {
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter{system};
    SimTK::GeneralForceSubsystem forces{system};
    std::vector<SimTK::MobilizedBody> body;  // of the tree's
    std::vector<SimTK::MobilizedBody> mover; // by coordinate

    static SimTK::Vec3 vec(const Triple &x)
    {
        return {x[0], x[1], x[2]};
    }

    SimTK::MobilizedBody &at(int k)
    {
        return k < 0 ? matter.updGround() : body[static_cast<size_t>(k)];
    }

    // A frame whose axis number `of` is the motion's.
    static SimTK::Rotation turned(const TreeMotion &m, const SimTK::CoordinateAxis &of)
    {
        return {SimTK::UnitVec3(vec(m.axis)), of};
    }

    SimbodyTree(const Tree &tree, bool native)
    {
        using namespace SimTK;
        matter.setShowDefaultGeometry(false);
        Force::UniformGravity(forces, matter, vec(tree.gravity));
        for (const TreeBody &b : tree.bodies) {
            const auto &i = b.inertia;
            Inertia about(Vec3(i[0], i[1], i[2]), Vec3(i[3], i[4], i[5]));
            Body::Rigid full(MassProperties(b.mass, vec(b.com), about.shiftFromMassCenter(vec(b.com), b.mass)));
            MobilizedBody last =
                b.parent < 0 ? static_cast<MobilizedBody>(matter.updGround()) : body[static_cast<size_t>(b.parent)];
            if (native && is_free(b)) {
                last = MobilizedBody::Bushing(last, Transform(vec(b.at)), full, Transform());
                body.push_back(last);
                for (int k = 0; k < 6; k++)
                    mover.push_back(last);
                continue;
            }
            for (size_t k = 0; k < b.motions.size(); k++) {
                const TreeMotion &m = b.motions[k];
                Vec3 where = k == 0 ? vec(b.at) : Vec3(0);
                Body::Rigid none((MassProperties(0, Vec3(0), Inertia(0))));
                const Body &now = k + 1 == b.motions.size() ? full : none;
                Rotation axes = turned(m, m.turns ? CoordinateAxis(ZAxis) : CoordinateAxis(XAxis));
                if (m.turns)
                    last = MobilizedBody::Pin(last, Transform(axes, where), now, Transform(axes, Vec3(0)));
                else
                    last = MobilizedBody::Slider(last, Transform(axes, where), now, Transform(axes, Vec3(0)));
                mover.push_back(last);
            }
            body.push_back(last);
        }
        for (const Pair &s : tree.springs) {
            Force::TwoPointLinearSpring(forces, at(s.a), vec(s.pa), at(s.b), vec(s.pb), s.stiffness, s.length);
            if (s.damping > 0)
                Force::TwoPointLinearDamper(forces, at(s.a), vec(s.pa), at(s.b), vec(s.pb), s.damping);
        }
        for (const auto &e : tree.efforts)
            Force::MobilityConstantForce(forces, mover[static_cast<size_t>(e.first)], MobilizerUIndex(0), e.second);
        for (const Held &s : tree.held) {
            MobilizedBody &body = mover[static_cast<size_t>(s.k)];
            Force::MobilityLinearSpring(forces, body, MobilizerQIndex(0), s.stiffness, s.rest);
            Force::MobilityLinearDamper(forces, body, MobilizerUIndex(0), s.damping);
        }
        for (const Coupled &s : tree.coupled)
            Force::Custom(forces,
                          new SimbodyCoupling(mover[static_cast<size_t>(s.a)], mover[static_cast<size_t>(s.b)], s));
        for (const Pair &r : tree.rods)
            Constraint::Rod(at(r.a), vec(r.pa), at(r.b), vec(r.pb), r.length);
        // A planar mechanism has no third row of a ball: the point stays on the line along z.
        for (const Pair &c : tree.closures)
            if (!is_plane(tree))
                Constraint::Ball(at(c.a), vec(c.pa), at(c.b), vec(c.pb));
            else
                Constraint::PointOnLine(at(c.a), UnitVec3(ZAxis), vec(c.pa), at(c.b), vec(c.pb));
    }
};

#endif
