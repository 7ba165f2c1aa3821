def figure(rows, path):
    pass
