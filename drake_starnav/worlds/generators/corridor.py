"""A corridor folded into lanes, to measure how planning time grows with the length of the path."""

from dataclasses import dataclass

import numpy as np

from drake_starnav.parameters import parameter
from drake_starnav.worlds.outlines import WALL, make_rectangle
from drake_starnav.worlds.solvable import Drawn, draw_random_yaw
from drake_starnav.worlds.world import World

_WIDTH = 1.5  # m


@dataclass(frozen=True)
class Corridor(Drawn):
    """Lanes of 8 m side by side, joined at alternating ends; fins from random sides make the lanes wind."""

    length: float = parameter(40.0, "length of the corridor's middle line", unit="m", low=10.0, high=300.0)
    fin: float = parameter(0.4, "share of the width that a fin takes; 0 for smooth walls", low=0.0, high=0.9)

    def draw(self, rng: np.random.Generator) -> World:
        pitch = _WIDTH + WALL
        lanes = max(1, round(self.length / (8.0 - _WIDTH + pitch)))
        # the middle line: straight runs of lane - width, and a step of one pitch between two lanes
        run = (self.length - (lanes - 1) * pitch) / lanes
        lane = run + _WIDTH
        polygons = []
        for k in range(1, lanes):
            y = k * pitch - WALL
            x_left, x_right = (0.0, run) if k % 2 else (_WIDTH, lane)
            polygons.append(make_rectangle(x_left, y, x_right, y + WALL))
        for k in range(lanes):
            bottom, top = k * pitch, k * pitch + _WIDTH
            reach = self.fin * _WIDTH
            x = _WIDTH + rng.uniform(0.5, 1.5)
            while reach > 0.0 and x < lane - _WIDTH - 0.5:
                low = rng.random() < 0.5
                polygons.append(
                    make_rectangle(x, bottom if low else top - reach, x + WALL, bottom + reach if low else top)
                )
                x += rng.uniform(1.2, 2.5) * _WIDTH
        half = _WIDTH / 2.0
        goal_x = lane - half if lanes % 2 else half
        return World(
            name="corridor",
            start=(half, half, draw_random_yaw(rng)),
            goal=(goal_x, (lanes - 1) * pitch + half),
            polygons=tuple(polygons),
            bounds=(0.0, 0.0, lane, lanes * pitch - WALL),
            timeout=60.0 * self.length / 10.0,  # for a mean speed of 0.17 m/s along the middle line
        )
