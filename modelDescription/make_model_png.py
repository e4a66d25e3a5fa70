"""Draws model.png: a tool that cuts a curled chip. Run once by hand (needs Pillow); the picture is committed."""

import math
from pathlib import Path

from PIL import Image, ImageDraw

SIZE, OVER = 128, 8  # pixels; drawn larger by OVER and reduced, which smooths the edges
STEEL, DARK, TOOL, HOT = (96, 125, 155), (38, 50, 64), (232, 168, 56), (214, 84, 44)


def main():
    side = SIZE * OVER
    image = Image.new("RGBA", (side, side), (0, 0, 0, 0))
    draw = ImageDraw.Draw(image)

    def scaled(points):
        return [(x * side, y * side) for x, y in points]

    # Workpiece: the uncut height left of the edge, the machined surface right of it.
    draw.polygon(scaled([(0.02, 0.60), (0.60, 0.60), (0.60, 0.76), (0.98, 0.76), (0.98, 0.98), (0.02, 0.98)]), fill=STEEL)
    # Chip: a band from the edge up the rake face, curling away from the tool over the uncut surface.
    centre, steps = (0.345, 0.47), 160
    outer, inner = [], []
    for i in range(steps + 1):
        turn = -0.20 + 3.75 * i / steps
        radius = 0.262 - 0.030 * i / steps
        width = 0.125 - 0.035 * i / steps
        direction = (math.cos(turn), -math.sin(turn))
        outer.append((centre[0] + radius * direction[0], centre[1] + radius * direction[1]))
        inner.append((centre[0] + (radius - width) * direction[0], centre[1] + (radius - width) * direction[1]))
    foot_outer, foot_inner = (0.605, 0.765), (0.43, 0.605)
    band = [foot_outer] + outer + inner[::-1] + [foot_inner]
    draw.polygon(scaled(band), fill=HOT)
    # Saw teeth of the shear bands along the chip.
    for i in range(8, steps, 16):
        draw.line(scaled([outer[i], inner[min(i + 5, steps)]]), fill=(122, 36, 22), width=int(0.016 * side))
    # Tool: vertical rake face, clearance below.
    draw.polygon(scaled([(0.62, 0.76), (0.62, 0.06), (0.97, 0.06), (0.97, 0.70)]), fill=TOOL, outline=DARK,
                 width=int(0.02 * side))
    image.resize((SIZE, SIZE), Image.LANCZOS).save(Path(__file__).with_name("model.png"), optimize=True)


main()
