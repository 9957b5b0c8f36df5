# SPDX-License-Identifier: MIT OR Apache-2.0
"""One function for each solver: the same triangle, in each solver's own words.

`build(orders, slices)` makes the structure, which does not depend on the direction, as far as the solver lets one do so.
`direction(structure, theta, phi)` solves one direction (degrees, in the silicone) in s and p and returns [[R, T], [R, T]].
`bloch(structure, theta, phi)`, where there is one, solves the Bloch wavevector of that direction once and reads R and T of every
incident order that propagates in the silicone, in s and p; it returns how many incident orders that were.

Every solver gets the permittivity of a slice at its mid-height. Those that sample it get 4096 samples, the cells that a wall cuts
with the mean of both materials.
"""

import math

import numpy as np

PERIOD, HEIGHT, WAVELENGTH = 10.0, 3.0, 0.55  # micrometres
SILICONE, AIR = 1.41, 1.0  # refractive indices
SAMPLES = 4096


def widths(slices):
    """Silicone's share of the period at the mid-height of each slice, from the silicone on."""
    return [1.0 - (i + 0.5) / slices for i in range(slices)]


def sampled(width):
    """Permittivity on a grid, silicone in the middle."""
    edges = np.arange(SAMPLES + 1) / SAMPLES
    low, high = 0.5 - width / 2, 0.5 + width / 2
    inside = np.clip(np.minimum(edges[1:], high) - np.maximum(edges[:-1], low), 0, None) * SAMPLES
    return AIR**2 + (SILICONE**2 - AIR**2) * inside


def tangential(theta, phi):
    """(kx, ky) in units of k0."""
    theta, phi = math.radians(theta), math.radians(phi)
    return SILICONE * math.sin(theta) * math.cos(phi), SILICONE * math.sin(theta) * math.sin(phi)


def incident_orders(theta, phi):
    """Orders of this Bloch wavevector that propagate in silicone."""
    kx, ky = tangential(theta, phi)
    spacing = WAVELENGTH / PERIOD
    return [m for m in range(-60, 61) if (kx + m * spacing) ** 2 + ky**2 < SILICONE**2]


class Inkstone:
    package = "inkstone"
    rule = "its own"

    def build(self, orders, slices):
        from inkstone import Inkstone as Simulator

        s = Simulator()
        s.lattice = PERIOD
        s.num_g = orders
        s.frequency = 1.0 / WAVELENGTH
        s.AddMaterial("silicone", SILICONE**2)
        s.AddLayer("in", 0, "silicone")
        for i, width in enumerate(widths(slices)):
            s.AddLayer(f"slice{i}", HEIGHT / slices, "vacuum")
            # Its damping of high orders is switched off: it moves shares by 2.5e-3 at 121 orders.
            s.AddPattern1D(f"slice{i}", "silicone", width * PERIOD, 0.5 * PERIOD, if_gibbs_correction=False)
        s.AddLayer("out", 0, "vacuum")
        return s

    def shares(self, s):
        incident, reflected = s.GetPowerFlux("in")
        transmitted, _ = s.GetPowerFlux("out")
        return [float(-reflected / incident), float(transmitted / incident)]

    def direction(self, s, theta, phi):
        s.SetExcitation(theta=theta, phi=phi, s_amplitude=1, p_amplitude=0, order=(0, 0))
        first = self.shares(s)
        s.SetExcitation(s_amplitude=0, p_amplitude=1, order=(0, 0))
        return [first, self.shares(s)]

    def bloch(self, s, theta, phi):
        self.direction(s, theta, phi)
        orders = [m for m in incident_orders(theta, phi) if m != 0]
        for m in orders:
            for amplitudes in ((1, 0), (0, 1)):
                s.SetExcitation(s_amplitude=amplitudes[0], p_amplitude=amplitudes[1], order=(m, 0))
                self.shares(s)
        return len(orders) + 1


class AFmm:
    package = "A_FMM"
    rule = "Li's rule"

    def build(self, orders, slices):
        from A_FMM.creator import Creator
        from A_FMM.layer import Layer, Layer_uniform
        from A_FMM.stack import Stack

        highest = orders // 2
        layers, thicknesses = [Layer_uniform(highest, 0, SILICONE**2)], [0.0]
        for width in widths(slices):
            creator = Creator()
            creator.slab(SILICONE**2, AIR**2, AIR**2, width)
            layers.append(Layer(highest, 0, creator))
            thicknesses.append(HEIGHT / slices / PERIOD)
        layers.append(Layer_uniform(highest, 0, AIR**2))
        thicknesses.append(0.0)
        stack = Stack(layers, thicknesses)
        stack.count_interface()
        return stack

    def solve(self, stack, theta, phi):
        k0 = PERIOD / WAVELENGTH
        kx, ky = tangential(theta, phi)
        stack.solve(k0, kx=kx * k0, ky=ky * k0)

    def incident(self, stack, theta, phi, orders):
        """R and T for each incident order, s then p, all by one pair of products."""
        top, bottom = stack.layers[0], stack.layers[-1]
        count = top.D
        kx, ky = tangential(theta, phi)
        place = {g[0]: i for i, g in top.G.items()}
        fields = np.zeros((2 * count, 2 * len(orders)), complex)
        for column, m in enumerate(orders):
            x = kx + m * WAVELENGTH / PERIOD
            length = math.hypot(x, ky)
            c, s = (x / length, ky / length) if length else (1.0, 0.0)
            fields[place[m], 2 * column], fields[place[m] + count, 2 * column] = -s, c
            fields[place[m], 2 * column + 1], fields[place[m] + count, 2 * column + 1] = c, s
        down = np.linalg.solve(top.V, fields)

        def power(layer, amplitudes):
            e, h = layer.V @ amplitudes, layer.VH @ amplitudes
            return (e[:count] * h[count:].conj() - e[count:] * h[:count].conj()).real.sum(axis=0)

        power_in = power(top, down)
        return (
            np.abs(power(top, stack.S.S21 @ down) / power_in),
            np.abs(power(bottom, stack.S.S11 @ down) / power_in),
        )

    def direction(self, stack, theta, phi):
        self.solve(stack, theta, phi)
        reflected, transmitted = self.incident(stack, theta, phi, [0])
        return [[float(r), float(t)] for r, t in zip(reflected, transmitted)]

    def bloch(self, stack, theta, phi):
        self.solve(stack, theta, phi)
        orders = incident_orders(theta, phi)
        self.incident(stack, theta, phi, orders)
        return len(orders)


class Torcwa:
    package = "torcwa"
    rule = "direct rule, sampled"

    def build(self, orders, slices):
        import torch

        torch.set_num_threads(1)
        cells = [torch.as_tensor(sampled(w)[:, None], dtype=torch.complex128) for w in widths(slices)]
        return orders // 2, slices, cells

    def solve(self, structure, theta, phi):
        import torch
        import torcwa

        highest, slices, cells = structure
        s = torcwa.rcwa(
            freq=1.0 / WAVELENGTH,
            order=[highest, 0],
            L=[PERIOD, 1.0],
            dtype=torch.complex128,
            device=torch.device("cpu"),
            stable_eig_grad=False,
        )
        s.add_input_layer(eps=SILICONE**2)
        s.add_output_layer(eps=AIR**2)
        s.set_incident_angle(inc_ang=math.radians(theta), azi_ang=math.radians(phi))
        for cell in cells:
            s.add_layer(thickness=HEIGHT / slices, eps=cell)
        s.solve_global_smatrix()
        return s

    def shares(self, s, structure, order):
        highest = structure[0]
        orders = [[m, 0] for m in range(-highest, highest + 1)]

        def total(port, pol):
            parts = [
                s.S_parameters(orders, direction="forward", port=port, polarization=out + pol, ref_order=[order, 0])
                for out in "sp"
            ]
            return sum(float((part.abs() ** 2).sum()) for part in parts)

        return [[total("reflection", pol), total("transmission", pol)] for pol in "sp"]

    def direction(self, structure, theta, phi):
        return self.shares(self.solve(structure, theta, phi), structure, 0)

    def bloch(self, structure, theta, phi):
        s = self.solve(structure, theta, phi)
        orders = incident_orders(theta, phi)
        for m in orders:
            self.shares(s, structure, m)
        return len(orders)


class Rcwa:
    package = "rcwa"
    rule = "direct rule, sampled"

    def build(self, orders, slices):
        return orders, slices, [sampled(w) for w in widths(slices)]

    def direction(self, structure, theta, phi):
        from rcwa import Crystal, Layer, LayerStack, Solver, Source

        orders, slices, cells = structure
        shares = []
        # Its spacing of the orders is right where k0 is 1: lengths are times k0.
        k0 = 2.0 * math.pi / WAVELENGTH
        # The convolution matrices are made when a Solver is; one Solver serves one polarisation.
        for pol in ([1, 0], [0, 1]):
            silicone, air = Layer(er=SILICONE**2, ur=1), Layer(er=AIR**2, ur=1)
            layers = [
                Layer(crystal=Crystal(np.array([PERIOD * k0, 0]), er=cell, ur=np.ones(SAMPLES)), thickness=HEIGHT / slices * k0)
                for cell in cells
            ]
            source = Source(
                wavelength=2.0 * math.pi, theta=math.radians(theta), phi=math.radians(phi), pTEM=pol, layer=silicone
            )
            stack = LayerStack(*layers, incident_layer=silicone, transmission_layer=air)
            solver = Solver(stack, source, orders)
            solver.solve()
            shares.append([float(solver.RTot), float(solver.TTot)])
        return shares


class Meent:
    package = "meent"
    rule = "its own, sampled"

    def build(self, orders, slices):
        cells = np.stack([np.sqrt(sampled(w))[None, :] for w in widths(slices)]).astype(complex)
        return orders // 2, slices, cells

    def direction(self, structure, theta, phi):
        from meent import call_mee

        highest, slices, cells = structure
        shares = []
        for psi in (math.pi / 2, 0.0):
            solver = call_mee(
                0,
                n_top=SILICONE,
                n_bot=AIR,
                theta=math.radians(theta),
                phi=math.radians(phi),
                psi=psi,
                period=[PERIOD, 1.0],
                wavelength=WAVELENGTH,
                ucell=cells,
                thickness=[HEIGHT / slices] * slices,
                fto=[highest, 0],
                type_complex=np.complex128,
            )
            result = solver.conv_solve()
            shares.append([float(result.de_ri.sum().real), float(result.de_ti.sum().real)])
        return shares


class Grcwa:
    package = "grcwa"
    rule = "its own, sampled"

    def build(self, orders, slices):
        return orders, slices, np.concatenate([sampled(w) for w in widths(slices)])

    def direction(self, structure, theta, phi):
        import grcwa

        orders, slices, cells = structure
        s = grcwa.obj(
            orders, [PERIOD, 0], [0, 1e-4], 1.0 / WAVELENGTH, math.radians(theta), math.radians(phi), verbose=0
        )
        s.Add_LayerUniform(0.0, SILICONE**2)
        for _ in range(slices):
            s.Add_LayerGrid(HEIGHT / slices, SAMPLES, 1)
        s.Add_LayerUniform(0.0, AIR**2)
        s.Init_Setup(Gmethod=0)
        s.GridLayer_geteps(cells)
        shares = []
        for p, s_amplitude in ((0, 1), (1, 0)):
            s.MakeExcitationPlanewave(p, 0, s_amplitude, 0, order=0)
            shares.append([float(x) for x in s.RT_Solve(normalize=1)])
        return shares


class Nannos:
    package = "nannos"
    rule = "its own, sampled"

    def build(self, orders, slices):
        import nannos

        nannos.set_backend("numpy")
        lattice = nannos.Lattice(PERIOD, discretization=SAMPLES)
        layers = [lattice.Layer("Superstrate", epsilon=SILICONE**2)]
        for i, width in enumerate(widths(slices)):
            layer = lattice.Layer(f"slice{i}", thickness=HEIGHT / slices)
            layer.epsilon = sampled(width).reshape(lattice.ones().shape).astype(complex)
            layers.append(layer)
        layers.append(lattice.Layer("Substrate", epsilon=AIR**2))
        return orders, layers

    def direction(self, structure, theta, phi):
        import nannos

        orders, layers = structure
        shares = []
        for psi in (0, 90):
            wave = nannos.PlaneWave(wavelength=WAVELENGTH, angles=(theta, phi, psi))
            reflected, transmitted = nannos.Simulation(layers, wave, nh=orders).diffraction_efficiencies()
            shares.append([float(reflected), float(transmitted)])
        return shares


SOLVERS = {kind.package: kind for kind in (Inkstone, AFmm, Torcwa, Rcwa, Meent, Grcwa, Nannos)}
