SOON = True
def find_light(image): return None
