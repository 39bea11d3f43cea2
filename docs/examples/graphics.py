from gacompiler.objects import PGA3, view

def scene(p, q, angle):
    line = p & q                                     # through both points
    moved = PGA3.motor(line, angle) >> PGA3.point(0, 1, 1)
    return {"p": p, "q": q, "line": line, "moved": moved}
points = PGA3.point(0, 0, 0), PGA3.point(1, 0, 0)
view(scene, drag=points, sliders={"angle": (0, 6.28)}).save("scene.html")
